"""Restores an opened book as two leaves, and any other scan as the whole."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from restore.edits.apply import edited_leaves
from restore.edits.finish import finish_page
from restore.edits.model import PageEdits
from restore.flattening.methods import OnStep
from restore.layout.find import inspect
from restore.layout.finding import BookPrior
from restore.layout.leaves import Layout, Leaves, leaves_of
from restore.page import RestoredPage
from restore.photo import Photograph
from restore.pipeline import Progress, restore
from restore.report import Report
from restore.runtime.arguments import checks_types
from restore.runtime.results import Kept
from restore.scan import Bytes, RangeScan, ScannedSheet, SurfaceMesh
from restore.settings import Settings


@dataclass(frozen=True, eq=False)
class RestoredLeaves:
    """The pages of a scan, each restored when it is asked for.

    found     the sheets of its `parts`: `left` and `right`, one of them, or `page`; its layout, and what is reported.
    settings  with which they are restored, but for corrections.
    edits     corrections by hand.
    kept      as for `restore`.
    """

    found: Leaves
    settings: Settings
    edits: PageEdits | None = None
    kept: Kept | None = None

    def settings_of(self, part: str) -> Settings:
        """Return the settings of a part, as corrected."""
        return self.settings if self.edits is None else self.edits.part(part).settings_of(self.settings)

    def page(
        self,
        part: str,
        settings: Settings | None = None,
        *,
        photos: Sequence[Photograph | Bytes] = (),
        progress: Progress | None = None,
        on_step: OnStep | None = None,
    ) -> RestoredPage:
        """Restore a part, its corrections applied.

        settings: those of `settings_of` by default.
        photos: (h, w, 3), or as `read_photographs` gives them; these, progress and on_step as for `restore`.
        """
        settings = settings or self.settings_of(part)
        sheet = self.found.parts[part]
        page = restore(sheet, settings, photos=photos, progress=progress, on_step=on_step, kept=self.kept)
        return page if self.edits is None else finish_page(page, self.edits.part(part))

    def parts(self, progress: Progress | None = None) -> Iterator[tuple[str, RestoredPage]]:
        """Restore one part after the other; the report of each has the layout, too."""
        for part in self.found.parts:
            page = self.page(part, progress=progress)
            found = (*page.findings, *self.found.findings)
            report: Report = {**page.report, **self.found.fields(part), "findings": [one.as_json() for one in found]}
            yield part, replace(page, report=report, findings=found)


@checks_types
def restore_leaves(
    scan: RangeScan | SurfaceMesh | ScannedSheet,
    settings: Settings | None = None,
    *,
    layout: Layout = "auto",
    edits: PageEdits | None = None,
    prior: BookPrior | None = None,
    kept: Kept | None = None,
) -> RestoredLeaves:
    """Restore the leaves of an opened book as two pages, and any other scan as one.

    layout: auto as `find_layout` advises, and the whole where it asks; split, left, right: at the valley that was
    found, whatever it is; whole: the largest sheet. prior: as for `find_layout`. edits: corrections by hand; their
    layout takes the place of `layout`. kept: as for `restore`.
    Raises NotEnoughSurface without a page, BadInput for a split without a valley and for corrections that do not fit.

    >>> from drivers.simulated import Facing, Opening, shoot
    >>> scan, truth = shoot(Opening(), Facing(left_mm=100.0), mode="fast", page_mm=(200.0, 140.0))
    >>> leaves = restore_leaves(scan, Settings(points=300, dpi=50))
    >>> [(part, round(page.report["page_mm"][0], -1)) for part, page in leaves.parts()]
    [('left', 100.0), ('right', 100.0)]
    """
    settings = settings or Settings()
    inspected = inspect(scan, settings, prior, kept)
    found = leaves_of(inspected, layout) if edits is None else edited_leaves(inspected, edits)
    return RestoredLeaves(found, settings, edits, kept)
