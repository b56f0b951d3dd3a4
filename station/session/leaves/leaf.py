"""List the leaf sides of a volume, in their order, with their labels.

A leaf side is what a reader turns to: one part of one scan.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TypeVar

from station.session.corrections.layers import kind_of, rules_of
from station.session.log.current import about_of, preset_of
from station.session.log.history import CapturedPage
from station.session.log.results import Checked, Restored
from station.session.log.store import Session
from station.session.terms.about import RTL
from station.session.terms.labels import Run, run_of_preset
from station.session.terms.parts import LEFT, PAGE, RIGHT, leaf_name
from station.verdict.checks import worst

UNCOUNTED = frozenset({"cover", "target", "insert", "foldout"})  # kinds without a label of their own
SPREADS = frozenset({"spread", "plate"})  # kinds that are two leaf sides, where they stay whole
ORDER, LEFT_OUT, MISSING, LABEL = "order", "left_out", "missing", "label"  # names of decisions
DASH = "–"  # between the two labels of a whole spread
T = TypeVar("T")


@dataclass(frozen=True)
class Leaf:
    """A leaf side of a volume.

    page      the page that it is a part of. part: page, left or right.
    position  among the leaf sides that are delivered, from 1; 0 for one that is left out.
    labels    empty where it is not counted, two for a spread that stays whole.
    kind      of what the scan shows, as of `PageEdits`; empty where it was not set.
    restored  the result of its restoration; None without one.
    missing   labels of leaf sides that are missing before it.
    """

    page: CapturedPage
    part: str
    position: int
    labels: tuple[str, ...]
    side: str
    kind: str
    restored: Restored | None
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
        decided = self.page.decided
        return bool(self._own(decided.left_out, decided.left_out_left, decided.left_out_right))

    @property
    def own_label(self) -> str | None:
        """The label that was decided; None where its place in a run decides."""
        return self._own(self.page.decided.label, self.page.decided.label_left, self.page.decided.label_right)

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

    def _own(self, of_page: T | None, left: T | None, right: T | None) -> T | None:
        """Return what was decided on this part, or on its page where it is the only one."""
        found = {LEFT: left, RIGHT: right}.get(self.part)
        split = self.page.restored is not None and self.page.restored.is_split
        return of_page if found is None and not split else found


def leaves_of(session: Session) -> list[Leaf]:
    """List the leaf sides of a volume, in their order."""
    return list(_labelled(session, _ordered(list(_found(session)), session.history.volume.decided.order)))


def delivered_leaves(session: Session) -> list[Leaf]:
    """List the leaf sides that are delivered: those that are not left out."""
    return [leaf for leaf in leaves_of(session) if not leaf.is_left_out]


def picture_of(session: Session, leaf: Leaf) -> Path | None:
    """Return the path of the restored picture of a leaf side, None without one."""
    run = leaf.page.restoration
    name = None if run is None else run.file(leaf.part)
    return None if run is None or name is None else session.path(run.event, name)


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
    runs = {run.start: run for run in session.history.volume.decided.labels}
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
        kind = kind_of(session, page, rules)
        parts = {PAGE: None} if page.restored is None else page.restored.leaves
        for part, restored in list(parts.items())[::order]:
            yield Leaf(page, part, 0, (), "", kind, restored)


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
    preset, decided = preset_of(session), session.history.volume.decided
    runs, absent = {run.start: run for run in decided.labels}, decided.missing
    run, place, count, position = run_of_preset(preset), 0, 0, 0
    for leaf in leaves:
        if leaf.name in runs:
            run, place = runs[leaf.name], 0
        missing = tuple(one.label for one in absent if one.before == leaf.name)
        for label in missing:
            place = _continued(run, label, place) + 1
        sides = 0 if leaf.is_left_out or leaf.kind in UNCOUNTED else 1 + is_spread(leaf)
        own = leaf.own_label
        if own is not None and runs and sides:
            place = _continued(run, own, place)
        labels = tuple(run.label(place + side) for side in range(sides)) if own is None else (own,)
        side = preset.side(count + 1) if sides == 1 else ""
        if leaf.part != PAGE or leaf.page.decided.side is not None:
            side = leaf.part if leaf.part != PAGE else leaf.page.decided.side or ""
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
