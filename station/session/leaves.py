"""List the leaf sides of a volume, in their order, with their labels.

A leaf side is what a reader turns to: one part of one scan.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from station.session.corrections import effective_edits, rules_of
from station.session.current_preset import preset_of
from station.session.history import Page
from station.session.parts import PAGE, RESTORE, VERDICT, leaf_name, parts_of
from station.session.presets import Preset
from station.session.store import Session

UNCOUNTED = frozenset({"cover", "target", "insert", "foldout"})  # kinds without a label of their own
SPREADS = frozenset({"spread", "plate"})  # kinds that are two leaf sides, where they stay whole
DASH = "–"  # between the two labels of a whole spread


@dataclass(frozen=True)
class Leaf:
    """A leaf side of a volume.

    page      the page that it is a part of. part: page, left or right.
    position  in the volume, from 1.
    labels    none where it is not counted, two for a spread that stays whole.
    kind      of what the scan shows, as of `PageEdits`; empty where it was not set.
    report    of its restoration; empty without one.
    """

    page: Page
    part: str
    position: int
    labels: tuple[str, ...]
    side: str
    kind: str
    report: Mapping[str, Any]

    @property
    def name(self) -> str:
        """`12`, or `12/left` for a part."""
        return leaf_name(self.page.number, self.part)

    @property
    def label(self) -> str:
        """Its label, or both of a spread."""
        return DASH.join(filter(None, self.labels))

    @property
    def is_checked(self) -> bool:
        """Whether its quality was checked."""
        return VERDICT in self.page.runs and "measures" in self.report

    @property
    def checks(self) -> list[Mapping[str, Any]]:
        """The quality checks of this part."""
        if not self.is_checked:
            return []
        checks = self.page.runs[VERDICT].facts["result"]["checks"]
        return [check for check in checks if check.get("part", self.part) == self.part]

    def decided(self, name: str, default: object = "") -> object:
        """The value of a decision on this part, or on its page where it is the only one."""
        alone = len(parts_of(_result(self.page))) == 1
        return self.page.decided(f"{name}_{self.part}", self.page.decided(name, default) if alone else default)


def leaves_of(session: Session) -> list[Leaf]:
    """The leaf sides of a volume, in their order."""
    preset, rules = preset_of(session), rules_of(session)
    leaves, count = list[Leaf](), 0
    for page in session.history.pages():
        kind = str((effective_edits(session, page, rules) or {}).get("kind", ""))
        for part, report in parts_of(_result(page)).items():
            counted = 0 if kind in UNCOUNTED else 1 + _is_spread(kind, part, report)
            places = range(count + 1, count + counted + 1)
            leaf = Leaf(page, part, len(leaves) + 1, tuple(map(preset.label, places)), "", kind, report)
            leaves.append(_decided(leaf, preset, count + 1 if counted == 1 else None))
            count += counted
    return leaves


def labels_of(session: Session) -> dict[int, str]:
    """Page → its label, or those of its leaves."""
    found = dict[int, list[str]]()
    for leaf in leaves_of(session):
        found.setdefault(leaf.page.number, []).append(leaf.label)
    return {page: DASH.join(filter(None, labels)) for page, labels in found.items()}


def missing_labels(session: Session) -> list[str]:
    """Return where the labels leave out pages: `between 12 and 15`.

    As decided or by the preset.
    """
    numbered = list(_numbered(leaves_of(session), preset_of(session)))
    return [f"between {one} and {two}" for (one, at), (two, then) in pairwise(numbered) if then > at + 1]


def _numbered(leaves: Sequence[Leaf], preset: Preset) -> Iterator[tuple[str, int]]:
    for label in (label for leaf in leaves for label in leaf.labels):
        if (place := preset.place(label)) is not None:
            yield label, place


def _decided(leaf: Leaf, preset: Preset, place: int | None) -> Leaf:
    """Give a leaf the label and the side that were decided.

    place: in the count of labels, None without one.
    """
    label = leaf.decided("label", None)
    side = leaf.part if leaf.part != PAGE else leaf.decided("side", "" if place is None else preset.side(place))
    labels = leaf.labels if label is None else (str(label),)
    return Leaf(leaf.page, leaf.part, leaf.position, labels, str(side), leaf.kind, leaf.report)


def _is_spread(kind: str, part: str, report: Mapping[str, Any]) -> bool:
    """Whether a page is two leaf sides, as was set or by print over its spine."""
    found = report.get("findings", ())
    codes = {one.get("code") for one in found if isinstance(one, dict)} if isinstance(found, list | tuple) else set()
    return part == PAGE and (kind in SPREADS or (not kind and "print_over_spine" in codes))


def _result(page: Page) -> Mapping[str, Any]:
    run = page.runs.get(RESTORE)
    result: Mapping[str, Any] = {} if run is None else run.facts["result"]
    return result
