"""Restore an opened book as two leaves, each flattened by itself, or as the whole where it is not one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

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
    prior: BookPrior | None = None,
    progress: Progress | None = None,
) -> RestoredLeaves:
    """Restore the leaves of an opened book as two pages, and any other scan as one.

    layout, prior: as for `find_leaves`. progress: as for `restore`, for each part.
    Raises NotEnoughSurface without a page, BadInput for a split without a valley.

    >>> from drivers.simulated import Facing, Opening, shoot
    >>> scan, truth = shoot(Opening(), Facing(left_mm=100.0), mode="fast", page_mm=(200.0, 140.0))
    >>> leaves = restore_leaves(scan, Settings(points=300, dpi=50))
    >>> [(part, round(page.report["page_mm"][0], -1)) for part, page in leaves.parts.items()]
    [('left', 100.0), ('right', 100.0)]
    """
    settings = settings or Settings()
    leaves = find_leaves(scan, layout, settings, prior=prior)
    pages = {part: restore(sheet, settings, progress=progress) for part, sheet in leaves.parts.items()}
    return RestoredLeaves(leaves.finding, {part: _reported(page, leaves, part) for part, page in pages.items()})


def _reported(page: RestoredPage, leaves: Leaves, part: str) -> RestoredPage:
    found = (*page.findings, *leaves.findings)
    report = {**page.report, **leaves.fields(part), "findings": [one.as_json() for one in found]}
    return replace(page, report=report, findings=found)
