"""Restores an opened book as two leaves, each flattened separately.

Or as the whole where it is not an opened book.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from restore.edits.apply import correct_leaves
from restore.edits.finish import finish_page
from restore.edits.model import PageEdits, PartEdits
from restore.layout.finding import BookPrior, LayoutFinding
from restore.layout.leaves import Layout, Leaves, find_leaves
from restore.page import RestoredPage
from restore.pipeline import Progress, restore
from restore.runtime.arguments import checks_types
from restore.scan import RangeScan, ScannedSheet, SurfaceMesh
from restore.settings import Settings


@dataclass(frozen=True, eq=False)
class RestoredLeaves:
    """The pages of a scan.

    finding  its layout.
    parts    `left` and `right`, one of them, or `page` → the restored page.
    """

    finding: LayoutFinding
    parts: Mapping[str, RestoredPage]


@checks_types
def restore_leaves(
    scan: RangeScan | SurfaceMesh | ScannedSheet,
    settings: Settings | None = None,
    *,
    layout: Layout = "auto",
    edits: PageEdits | None = None,
    prior: BookPrior | None = None,
    progress: Progress | None = None,
) -> RestoredLeaves:
    """Restore the leaves of an opened book as two pages, and any other scan as one.

    layout, prior: as for `find_leaves`. edits: corrections by hand; their layout takes the place of `layout`.
    progress: as for `restore`, for each part.
    Raises NotEnoughSurface without a page, BadInput for a split without a valley and for corrections that do not fit.

    >>> from drivers.simulated import Facing, Opening, shoot
    >>> scan, truth = shoot(Opening(), Facing(left_mm=100.0), mode="fast", page_mm=(200.0, 140.0))
    >>> leaves = restore_leaves(scan, Settings(points=300, dpi=50))
    >>> [(part, round(page.report["page_mm"][0], -1)) for part, page in leaves.parts.items()]
    [('left', 100.0), ('right', 100.0)]
    """
    settings = settings or Settings()
    if edits is None:
        leaves = find_leaves(scan, layout, settings, prior=prior)
    else:
        leaves = correct_leaves(scan, edits, settings, prior=prior)
    pages = {}
    for part, sheet in leaves.parts.items():
        by_hand = PartEdits() if edits is None else edits.part(part)
        page = restore(sheet, by_hand.settings_of(settings), progress=progress)
        pages[part] = _reported(page if edits is None else finish_page(page, by_hand), leaves, part)
    return RestoredLeaves(leaves.finding, pages)


def _reported(page: RestoredPage, leaves: Leaves, part: str) -> RestoredPage:
    found = (*page.findings, *leaves.findings)
    report = {**page.report, **leaves.fields(part), "findings": [one.as_json() for one in found]}
    return page.changed(report=report, findings=found)
