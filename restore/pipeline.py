"""One scan, from the range grid to the page: prepare → unroll (decimate, flatten, refine) → texture → shade."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from restore.findings import Finding, finding
from restore.flattening.methods import DEFAULT, OnStep
from restore.flattening.ordered_grid import thinned
from restore.mesh.clean import clean
from restore.mesh.ordered_grid import GridMesh
from restore.page import RestoredPage
from restore.photo import (
    Photograph,
    Registered,
    paint_registered,
    photo_findings,
    register_photographs,
    remove_registered_shading,
)
from restore.prepared.facet_sheet import unroll
from restore.prepared.flatten import flatten
from restore.prepared.ordered_grid import unroll_grid
from restore.prepared.prepare import prepare
from restore.prepared.prepared import Unrolled, square_to_picture
from restore.range_image.facets.sheet import Sheet
from restore.range_image.segmentation.segment import SegmentedScan
from restore.report import describe, findings_of_page
from restore.runtime.arguments import checks_types
from restore.scan import Bytes, InterpolatedMesh, RangeScan, SurfaceMesh
from restore.settings import Settings
from restore.shading.relief import relief_of
from restore.shading.remove import LIGHT_DPI, ShadingResult
from restore.shading.white import WhiteBalance, balance_on_paper
from restore.texture.coverage import (
    Coverage,
    Seen,
    compute_coverage,
    cut_findings,
    cut_share,
    filled_findings,
    with_interpolated,
)
from restore.texture.holes import end_at_holes, hole_findings, holes_on_page
from restore.texture.inpaint import blank_hidden, inpaint_hidden
from restore.texture.occlusion import mirror_findings
from restore.texture.page import Painting

STAGES = ("prepare", "decimate", "flatten", "refine", "texture", "shade")

Progress = Callable[[str, float], None]


@checks_types
def restore(
    scan: RangeScan | SurfaceMesh | SegmentedScan,
    settings: Settings | None = None,
    *,
    photos: Sequence[Photograph | Bytes] = (),
    progress: Progress | None = None,
    on_step: OnStep | None = None,
) -> RestoredPage:
    """Turn a scan of a warped page into the flat page.

    scan: one that `load_scan` or a scanner gave, or the `segmented` of a sheet that `separate_sheets` found in it.
    photos: photographs of the same page by any camera, (h, w, 3) uint8 RGB or as `read_photograph` gives them. The page
    is painted from those whose registration to the scan is certain; the report lists all.
    progress(stage, fraction done) is called at the start and end of each stage;
    on_step(step, positions (n, 3) mm, faces (m, 3)) after every time step of the flattening.
    Raises NotEnoughSurface when there is no page in the scan, BadInput when the scan cannot be used.

    >>> from drivers.simulated import Curl, shoot
    >>> scan, truth = shoot(Curl(), mode="fast", page_mm=(200.0, 150.0))
    >>> page = restore(scan, Settings(points=300, dpi=100))
    >>> page.image.dtype, [round(side, -1) for side in page.report["page_mm"]]
    (dtype('uint8'), [200.0, 150.0])
    """
    settings = settings or Settings()
    clock = Stopwatch(progress)
    with clock("prepare"):
        surface = prepare(scan)
    unrolled = _unroll(surface, settings, clock, on_step)
    registered: list[Registered] = []
    if photos:
        with clock("register"):
            registered = register_photographs(unrolled.fine, photos)
    with clock("texture"):
        painting, photo_report = paint_registered(unrolled.fine, registered, settings.dpi)
        coverage = compute_coverage(surface, unrolled.fine, painting, settings.dpi)
        if isinstance(scan, InterpolatedMesh):
            coverage = with_interpolated(coverage, scan, unrolled.fine, settings.dpi)
        holes = holes_on_page(surface, unrolled.fine, painting.mask.shape, settings.dpi)
        painting, coverage = end_at_holes(painting, coverage, holes)
        painting = replace(painting, image=blank_hidden(painting.image, coverage), mask=coverage.mask)
    with clock("shade"):
        shading = _remove_shading(surface, unrolled, painting, registered, settings)
        balance = _balance_white(shading.image, painting, unrolled, settings)
        image = blank_hidden(balance.image, coverage)
        image, coverage = inpaint_hidden(image, coverage, settings.dpi, settings.fill_hidden_mm)
    report = describe(surface, unrolled, painting, settings)
    found = findings_of_page(surface, unrolled.fine, report)
    found += mirror_findings(unrolled.fine)
    found += [*_cut_off(scan, surface, painting, coverage), *hole_findings(holes, settings.dpi)]
    report |= {"light": shading.report, "white": balance.report, "coverage": coverage.shares()}
    filled = [] if isinstance(scan, InterpolatedMesh) else filled_findings(coverage.seen, settings.dpi)
    found += [*_kept(shading, balance), *coverage.findings(), *filled]
    report |= {"source": dict(scan.provenance), "seconds": clock.seconds}
    if photos:
        report["photos"] = photo_report
        found += photo_findings(registered, photo_report)
    report["findings"] = [one.as_json() for one in found]
    return RestoredPage(
        image,
        settings.dpi,
        coverage.mask,
        unrolled.coarse,
        report,
        painting.source,
        unrolled.fine,
        painting.image,
        coverage.seen,
        painting.page_source,
        findings=tuple(found),
    )


def _cut_off(
    scan: RangeScan | SurfaceMesh | SegmentedScan, surface: Sheet | SurfaceMesh, painting: Painting, coverage: Coverage
) -> list[Finding]:
    """What is to be reported of a page that leaves the scanner's picture; the edge of a mesh's atlas says nothing."""
    if isinstance(scan, SegmentedScan):
        scan = scan.scan
    if not isinstance(scan, RangeScan) or painting.page_source is not None:
        return []
    if scan.texture is None:
        return cut_findings(surface.cut if isinstance(surface, Sheet) else 0.0)
    return cut_findings(cut_share(coverage.seen != Seen.OUTSIDE, painting.source, scan.texture.shape[:2]))


def _remove_shading(
    surface: Sheet | SurfaceMesh,
    unrolled: Unrolled,
    painting: Painting,
    registered: Sequence[Registered],
    settings: Settings,
) -> ShadingResult:
    """The page without shading, or unchanged when the settings keep it or the scan has no texture."""
    if settings.shading == "keep" or unrolled.fine.texture is None:
        return ShadingResult(painting.image, {})
    relief = relief_of(surface, unrolled.fine, min(LIGHT_DPI, settings.dpi))
    return remove_registered_shading(unrolled.fine, registered, settings.dpi, relief, painting.image, painting.mask)


def _balance_white(image: Bytes, painting: Painting, unrolled: Unrolled, settings: Settings) -> WhiteBalance:
    """The page in the colours that the settings ask for; unchanged when the scan has no texture."""
    if settings.white == "keep" or unrolled.fine.texture is None:
        return WhiteBalance(image, {"mode": "keep"})
    balance = balance_on_paper(image, painting.mask, settings.dpi)
    return replace(balance, report={"mode": settings.white, **balance.report})


def _kept(shading: ShadingResult, balance: WhiteBalance) -> list[Finding]:
    """What the settings ask for and the page does not allow."""
    asked = (("light_kept", shading.report), ("white_kept", balance.report))
    return [finding(code, reason=report["reason"]) for code, report in asked if "reason" in report]


def _unroll(surface: Sheet | SurfaceMesh, settings: Settings, clock: Stopwatch, on_step: OnStep | None) -> Unrolled:
    if isinstance(surface, Sheet):
        return unroll(surface, settings, clock, on_step)
    count = settings.points or len(surface.vertices)
    if isinstance(surface, GridMesh) and settings.method == DEFAULT:  # all points tell the shape
        with clock("flatten"):
            return unroll_grid(surface, count)
    with clock("decimate"):
        mesh = thinned(surface, count) if isinstance(surface, GridMesh) else clean(surface, count)
    with clock("flatten"):
        flat = square_to_picture(flatten(mesh, settings.method, on_step=on_step))
    return Unrolled(flat, flat, np.empty((0, 2)), {})


class Stopwatch:
    """Measures the seconds of each stage and reports its progress."""

    def __init__(self, progress: Progress | None) -> None:
        self.seconds = dict.fromkeys(STAGES, 0.0)
        self._progress = progress

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        self._report(stage, 0.0)
        start = time.perf_counter()
        yield
        self.seconds[stage] = time.perf_counter() - start
        self._report(stage, 1.0)

    def _report(self, stage: str, done: float) -> None:
        if self._progress:
            self._progress(stage, done)
