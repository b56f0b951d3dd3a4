"""Compare the leaf sides of a volume with their neighbours."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import median_abs_deviation, norm

from restore.scan import Floats
from station.session.leaves.leaf import Leaf, delivered_leaves
from station.session.log.results import Checked, QualityCheck
from station.session.log.store import Session
from station.verdict.checks import ASKED, LEVELS, level_of, worst

AXES = ("width", "height")


@dataclass(frozen=True)
class ComparedLeaf:
    """A leaf side with its checks and those that compare it with its neighbours.

    rank: how bad it is, as of a page.
    """

    leaf: Leaf
    checks: Sequence[Checked]

    @property
    def level(self) -> str:
        """The worst level of its checks; empty without any."""
        return worst([check.level for check in self.checks]) if self.checks else ""

    @property
    def rank(self) -> float:
        """How bad it is."""
        if self.leaf.restored is not None and self.leaf.restored.error is not None:
            return float(len(LEVELS))
        return QualityCheck(level=worst([one.level for one in self.checks]), checks=list(self.checks)).rank


def compared_leaves(session: Session) -> list[ComparedLeaf]:
    """List the delivered leaf sides of a volume in their order, each with its checks."""
    leaves = delivered_leaves(session)
    found: dict[str, list[Checked]] = {leaf.name: list(leaf.checks) for leaf in leaves}
    for side in {leaf.side for leaf in leaves}:
        measured = [leaf for leaf in leaves if leaf.side == side and leaf.restored and leaf.restored.page_mm]
        for leaf, check in _size_checks(measured):
            found[leaf.name].append(check)
    for leaf in _moved(leaves):
        found[leaf.name].append(_check("order", 1.0, ASKED, "it is not where it was captured"))
    return [ComparedLeaf(leaf, found[leaf.name]) for leaf in leaves]


def _size_checks(leaves: Sequence[Leaf], reach: int = 4) -> Iterator[tuple[Leaf, Checked]]:
    """Yield width and height of leaf sides as checks against their neighbours.

    A difference is amber where normal noise makes one as large in a volume, and red where it is twice that. The noise:
    the scatter of all differences, and what a size is known to.
    """
    if len(leaves) <= reach:
        return
    sizes = np.array([leaf.restored.page_mm for leaf in leaves if leaf.restored and leaf.restored.page_mm], float)
    measures = [leaf.restored.measures for leaf in leaves if leaf.restored]
    known = np.array([getattr(one, "size_ci95_mm", None) or 0.0 for one in measures]) / norm.ppf(0.975)
    for axis, name in enumerate(AXES):
        off = _differences(sizes[:, axis], reach)
        amber = norm.isf(0.25 / len(leaves)) * np.hypot(median_abs_deviation(off, scale="normal"), known)
        for leaf, difference, limit in zip(leaves, off.tolist(), amber.tolist(), strict=True):
            if limit > 0:
                text = f"{name} {difference:+.1f} mm from its neighbours"
                yield leaf, _check(name, abs(difference), (limit, 2 * limit), text)


def _differences(values: Floats, reach: int) -> Floats:
    """Return each value (n,) less the median of its neighbours before and after."""
    padded = np.pad(values, reach, constant_values=np.nan)
    around = np.delete(np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1), reach, axis=1)
    return values - np.nanmedian(around, axis=1)


def _moved(leaves: Sequence[Leaf]) -> Iterator[Leaf]:
    """Yield the fewest leaf sides that are not in the order of their capture."""
    ends, before, places = list[int](), list[int](), list[int]()  # of the longest rising run of each length
    numbers = [leaf.page.number for leaf in leaves]
    for at, number in enumerate(numbers):
        place = bisect_right(ends, number)
        ends[place : place + 1] = [number]
        places[place : place + 1] = [at]
        before.append(places[place - 1] if place else -1)
    kept, at = set[int](), places[-1] if places else -1
    while at >= 0:
        kept.add(at)
        at = before[at]
    yield from (leaf for at, leaf in enumerate(leaves) if at not in kept)


def _check(name: str, value: float, limits: tuple[float, float], text: str) -> Checked:
    return Checked(
        name=name,
        level=level_of(value, limits),
        value=value,
        limits=list(limits),
        text=text,
        hint="compare it with its neighbours",
    )
