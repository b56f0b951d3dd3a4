"""List the leaf sides of a volume, in their order, with their labels.

A leaf side is what a reader turns to: one part of one scan.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from station.session.corrections.layers import effective_edits, rules_of
from station.session.log.current import about_of, preset_of
from station.session.log.events import VOLUME
from station.session.log.history import Page
from station.session.log.results import Checked, Restored
from station.session.log.store import Session
from station.session.terms.about import RTL
from station.session.terms.labels import LABELS, LEAF_ORDER, MISSING_LEAVES, RUNS, Missing, Run, run_of_preset
from station.session.terms.parts import PAGE, RESTORE, leaf_name, parts_of
from station.verdict.checks import worst

UNCOUNTED = frozenset({"cover", "target", "insert", "foldout"})  # kinds without a label of their own
SPREADS = frozenset({"spread", "plate"})  # kinds that are two leaf sides, where they stay whole
ORDER, LEFT_OUT, MISSING, LABEL = "order", "left_out", "missing", "label"  # names of decisions
DASH = "–"  # between the two labels of a whole spread


@dataclass(frozen=True)
class Leaf:
    """A leaf side of a volume.

    page      the page that it is a part of. part: page, left or right.
    position  among the leaf sides that are delivered, from 1; 0 for one that is left out.
    labels    empty where it is not counted, two for a spread that stays whole.
    kind      of what the scan shows, as of `PageEdits`; empty where it was not set.
    report    of its restoration; empty without one.
    missing   labels of leaf sides that are missing before it.
    """

    page: Page
    part: str
    position: int
    labels: tuple[str, ...]
    side: str
    kind: str
    report: Mapping[str, Any]
    missing: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """`12`, or `12/left` for a part."""
        return leaf_name(self.page.number, self.part)

    @property
    def label(self) -> str:
        """Its label, or both of a spread."""
        return DASH.join(filter(None, self.labels))

    @property
    def is_left_out(self) -> bool:
        """Whether it is kept and not delivered."""
        return self.decided(LEFT_OUT, False) is True

    @property
    def restored(self) -> Restored | None:
        """The result of its restoration."""
        return None if self.page.restored is None else self.page.restored.leaves.get(self.part)

    @property
    def is_checked(self) -> bool:
        """Whether its quality was checked."""
        return self.page.quality is not None and self.restored is not None and self.restored.measures is not None

    @property
    def checks(self) -> Sequence[Checked]:
        """The quality checks of this part."""
        quality = self.page.quality
        return quality.of(self.part) if quality is not None and self.is_checked else ()

    @property
    def level(self) -> str:
        """The worst level of its checks; empty without any."""
        return worst([check.level for check in self.checks]) if self.is_checked else ""

    @property
    def tag(self) -> int:
        """Number of the last decision on it: on its label, or that it is left out; 0 for none."""
        names = {end for name in (LABEL, LEFT_OUT) for end in (name, f"{name}_{self.part}")}
        return max((decision.number for name, decision in self.page.decisions.items() if name in names), default=0)

    def decided(self, name: str, default: object = "") -> object:
        """The value of a decision on this part, or on its page where it is the only one."""
        split = self.page.restored is not None and self.page.restored.is_split
        return self.page.decided(f"{name}_{self.part}", default if split else self.page.decided(name, default))


def leaves_of(session: Session) -> list[Leaf]:
    """List the leaf sides of a volume, in their order."""
    return list(_labelled(session, _ordered(list(_found(session)), order_of(session))))


def delivered_leaves(session: Session) -> list[Leaf]:
    """List the leaf sides that are delivered: those that are not left out."""
    return [leaf for leaf in leaves_of(session) if not leaf.is_left_out]


def leaves_by_page(session: Session) -> dict[int, list[Leaf]]:
    """Return page → its leaf sides, the pages in the order of their first ones."""
    found = dict[int, list[Leaf]]()
    for leaf in leaves_of(session):
        found.setdefault(leaf.page.number, []).append(leaf)
    return found


def label_of(leaves: Sequence[Leaf]) -> str:
    """Return the label of a page: that of its leaf sides."""
    return DASH.join(filter(None, (leaf.label for leaf in leaves)))


def labels_of(session: Session) -> dict[int, str]:
    """Return page → its label, or those of its leaves."""
    return {page: label_of(leaves) for page, leaves in leaves_by_page(session).items()}


def runs_of(session: Session) -> list[Run]:
    """Return the runs of labels that were decided."""
    return RUNS.validate_python(session.history.page(VOLUME).decided(LABELS, []))


def missing_of(session: Session) -> list[Missing]:
    """Return the leaf sides that are known to be missing."""
    return MISSING_LEAVES.validate_python(session.history.page(VOLUME).decided(MISSING, []))


def order_of(session: Session) -> list[str]:
    """Return the names of leaf sides in the order that was decided."""
    return LEAF_ORDER.validate_python(session.history.page(VOLUME).decided(ORDER, []))


def missing_labels(session: Session) -> list[str]:
    """List where the labels leave out pages: `between 12 and 15`."""
    return [
        f"between {one} and {two}"
        for labels in _runs_with_labels(session)
        for (one, at), (two, then) in pairwise(labels)
        if then > at + 1
    ]


def _runs_with_labels(session: Session) -> list[list[tuple[str, int]]]:
    """Return the labels of each run that are of its kind, with their places."""
    runs = {run.start: run for run in runs_of(session)}
    run = run_of_preset(preset_of(session))
    found: list[list[tuple[str, int]]] = [[]]
    for leaf in delivered_leaves(session):
        if leaf.name in runs:
            run = runs[leaf.name]
            found.append([])
        places = ((label, run.place(label)) for label in (*leaf.missing, *leaf.labels))
        found[-1] += [(label, place) for label, place in places if place is not None]
    return found


def _found(session: Session) -> Iterator[Leaf]:
    """Yield the leaf sides as they were captured, without labels."""
    rules = rules_of(session)
    order = -1 if about_of(session.history).direction == RTL else 1
    for page in session.history.pages():
        kind = str((effective_edits(session, page, rules) or {}).get("kind", ""))
        for part, report in list(parts_of(_result(page)).items())[::order]:
            yield Leaf(page, part, 0, (), "", kind, report)


def _ordered(leaves: list[Leaf], order: Sequence[str]) -> list[Leaf]:
    """Sort leaf sides as was decided, later ones after those they follow."""
    if not order:
        return leaves
    by_name = {leaf.name: leaf for leaf in leaves}
    by_page = dict[str, list[str]]()
    for name in by_name:
        by_page.setdefault(name.partition("/")[0], []).append(name)
    wanted = [name for one in order for name in ([one] if one in by_name else by_page.get(one, []))]
    placed = list(dict.fromkeys(wanted))
    known = set(placed)
    for before, name in pairwise(["", *by_name]):
        if name not in known:
            placed.insert(placed.index(before) + 1 if before else 0, name)
    return [by_name[name] for name in placed]


def _labelled(session: Session, leaves: Sequence[Leaf]) -> Iterator[Leaf]:
    """Yield leaf sides with positions, sides and labels."""
    preset, runs = preset_of(session), {run.start: run for run in runs_of(session)}
    absent = missing_of(session)
    run, place, count, position = run_of_preset(preset), 0, 0, 0
    for leaf in leaves:
        if leaf.name in runs:
            run, place = runs[leaf.name], 0
        missing = tuple(one.label for one in absent if one.before == leaf.name)
        for label in missing:
            place = _continued(run, label, place) + 1
        sides = 0 if leaf.is_left_out or leaf.kind in UNCOUNTED else 1 + is_spread(leaf)
        own = leaf.decided(LABEL, None)
        if own is not None and runs and sides:
            place = _continued(run, str(own), place)
        labels = tuple(run.label(place + side) for side in range(sides)) if own is None else (str(own),)
        side = preset.side(count + 1) if sides == 1 else ""
        side = leaf.part if leaf.part != PAGE else str(leaf.decided("side", side))
        place, count, position = place + sides, count + sides, position + (not leaf.is_left_out)
        shown = 0 if leaf.is_left_out else position
        yield replace(leaf, position=shown, labels=labels, side=side, missing=missing)


def _continued(run: Run, label: str, place: int) -> int:
    """Return the place of a label in a run; the present one for a label of another kind."""
    found = run.place(label)
    return place if found is None else found


def is_spread(leaf: Leaf) -> bool:
    """Whether a page is two leaf sides, as was set or by print over its spine."""
    printed = leaf.restored is not None and "print_over_spine" in leaf.restored.codes
    return leaf.part == PAGE and (leaf.kind in SPREADS or (not leaf.kind and printed))


def _result(page: Page) -> Mapping[str, Any]:
    run = page.runs.get(RESTORE)
    result: Mapping[str, Any] = {} if run is None else run.facts["result"]
    return result
