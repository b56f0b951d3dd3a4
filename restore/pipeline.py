"""One scan, from the range grid to the page.

The stages: prepare → unroll (decimate, flatten, refine) → texture → shade.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from math import hypot
from typing import NamedTuple

from restore.findings import Finding
from restore.flattening.methods import OnStep
from restore.page import FlatMesh, RestoredPage
from restore.photo import (
    Photograph,
    Registered,
    paint_registered,
    photo_findings,
    register_photographs,
    remove_registered_shading,
)
from restore.prepared.description import describe, findings_of_page
from restore.prepared.pictures import LargePage, seen_at, whole_pictures
from restore.prepared.prepare import prepare
from restore.prepared.prepared import Prepared, rotated, unrolled
from restore.prepared.separate import rotation_of, source_of
from restore.report import (
    CoverageReport,
    LeafReport,
    LightReport,
    PhotoReport,
    PhotosReport,
    Report,
    ShadeReport,
    SizeReport,
    WhiteReport,
)
from restore.runtime.arguments import checks_types
from restore.runtime.results import Kept
from restore.scan import Bytes, Mask, Provenance, RangeScan, ScannedSheet, SurfaceMesh
from restore.settings import Settings
from restore.shading.relief import relief_of
from restore.shading.remove import LIGHT_DPI, PageLight
from restore.shading.white import WhiteBalance, balance_on_paper
from restore.texture.coverage import Coverage, cover, hole_findings, seen_part
from restore.texture.inpaint import blank_hidden, inpaint_hidden
from restore.texture.occlusion import mirror_findings
from restore.texture.page import Painting
from restore.uncertainty.calibration import describe_calibration, edge_error, size_interval
from restore.uncertainty.estimate import Uncertainty, estimate_uncertainty

STAGES = ("prepare", "decimate", "flatten", "refine", "texture", "shade")

Progress = Callable[[str, float], None]


@checks_types
def restore(
    scan: RangeScan | SurfaceMesh | ScannedSheet,
    settings: Settings | None = None,
    *,
    photos: Sequence[Photograph | Bytes] = (),
    progress: Progress | None = None,
    on_step: OnStep | None = None,
    kept: Kept | None = None,
) -> RestoredPage:
    """Turn a scan of a warped page into the flat page.

    scan: one that `load_scan` or a scanner gave, or a sheet that `separate_sheets` found in one.
    photos: photographs of the same page by any camera, (h, w, 3) uint8 RGB or as `read_photographs` gives them. The
        page is textured from those that are registered reliably to the scan; the report lists all.
    progress: called as progress(stage, fraction done) at the start and end of each stage.
    on_step: called as on_step(step, positions (n, 3) mm, faces (m, 3)) after every time step of the flattening.
    kept: results of an earlier restoration of the same page, which are used again.
    Raises NotEnoughSurface when the scan shows no page, BadInput when it cannot be used.

    >>> from drivers.simulated import Curl, shoot
    >>> scan, truth = shoot(Curl(), mode="fast", page_mm=(200.0, 150.0))
    >>> page = restore(scan, Settings(points=300, dpi=100))
    >>> page.image.dtype, [round(side, -1) for side in page.report["page_mm"]]
    (dtype('uint8'), [200.0, 150.0])
    """
    settings = settings or Settings()
    clock = Stopwatch(progress)
    with clock("prepare"):
        prepared = prepare(scan, kept)
        source = source_of(scan)
    flat = rotated(unrolled(prepared, settings, clock, on_step, kept), rotation_of(scan))
    fine, dpi = flat.fine, settings.dpi
    registered: list[Registered] = []
    if photos:
        with clock("register"):
            registered = register_photographs(fine, photos)
    at = dpi if registered else seen_at(fine, settings)
    with clock("texture"):
        painted, photo_report, kinds, coverage = _paint(prepared, fine, registered, at)
        painting = seen_part(painted, coverage)
    with clock("shade"):
        shaded = _shade(prepared, fine, painting, registered, settings, at)
        image = blank_hidden(shaded.image, coverage)
        image, coverage = inpaint_hidden(image, coverage, dpi, settings.inpaint_mm)
    if at == dpi:
        pictures = whole_pictures(image, painted, painting, coverage)
    else:
        pictures = LargePage.of(prepared, fine, dpi, painted.mask, coverage, partial(shaded.relit, dpi=dpi)).pictures()
    described = describe(prepared, flat, painting, settings)
    found = [
        *findings_of_page(fine, described["strain"]),
        *prepared.findings,
        *mirror_findings(fine),
        *hole_findings(painted.mask, kinds, at),
        *shaded.findings,
        *coverage.findings(at),
        *prepared.findings_on(painting, coverage, at),
        *photo_findings(registered, photo_report),
    ]
    uncertainty: Uncertainty | str | None = None
    if settings.uncertainty:
        with clock("uncertainty"):
            uncertainty = estimate_uncertainty(prepared, flat, source)
    page_mm, ppi, seen = described["page_mm"], painting.resolution.sampling_ppi, coverage.described()
    given: PhotosReport = {"photos": photo_report} if photos else {}
    report: Report = {
        **described,
        **shaded.report,
        "coverage": seen,
        "source": dict(source.provenance),
        "seconds": clock.seconds,
        **given,
        **leaf_size(page_mm, seen),
        **size_report(source.provenance, page_mm, uncertainty, ppi),
        "findings": [one.as_json() for one in found],
    }
    page = RestoredPage(pictures, dpi, flat.coarse, fine, report, tuple(found))
    if isinstance(uncertainty, Uncertainty):
        page = page.with_pictures(uncertainty=uncertainty.on_page(page.mask))
    return page


def size_report(
    provenance: Provenance, page_mm: Sequence[float], uncertainty: Uncertainty | str | None, ppi: float
) -> SizeReport:
    """Report calibration, size interval and uncertainty, mm.

    uncertainty: None where it was not asked for, or why it cannot be estimated. ppi: as for `edge_error`.
    """
    calibration = describe_calibration(provenance)
    sides_mm = [edge_error(ppi)] * 2
    if isinstance(uncertainty, Uncertainty):
        sides_mm = [hypot(edges, side) for edges, side in zip(sides_mm, uncertainty.sides.tolist(), strict=True)]
    known: SizeReport = {"calibration": calibration, "size_mm_ci95": size_interval(calibration, page_mm, sides_mm)}
    if uncertainty is None:
        return known
    stated = {"reason": uncertainty} if isinstance(uncertainty, str) else uncertainty.described()
    return {"uncertainty_mm": stated, **known}


def leaf_size(page_mm: Sequence[float], coverage: CoverageReport) -> LeafReport:
    """Report the size of a leaf without the strip of the facing page, if it has one."""
    facing, (width, height) = coverage["facing"], page_mm
    return {"leaf_mm": [width * (1.0 - facing), height]} if facing else {}


class Painted(NamedTuple):
    """Textured page at some resolution, with coverage and reports on its photographs."""

    painting: Painting
    photos: list[PhotoReport]
    kinds: Bytes
    coverage: Coverage


def _paint(prepared: Prepared, fine: FlatMesh, registered: Sequence[Registered], dpi: float) -> Painted:
    """The page at `dpi`, and what of it the camera saw."""
    painting, photos = paint_registered(fine, registered, dpi)
    kinds = prepared.kinds_on(fine, painting.mask, dpi)
    centre, one_shot = prepared.camera_centre(fine), prepared.is_one_shot
    return Painted(painting, photos, kinds, cover(fine, painting, kinds, centre, dpi, may_be_cut=one_shot))


class Shaded(NamedTuple):
    """Page (h, w, 3) in the wanted light and colours, with report fields and findings."""

    image: Bytes
    report: ShadeReport
    findings: tuple[Finding, ...]
    light: PageLight | None = None
    white: WhiteBalance | None = None

    def relit(self, image: Bytes, mask: Mask, top: int, *, dpi: float) -> Bytes:
        """Return rows (h, w, 3) from `top` on of the page at `dpi`, in the same light and colours."""
        image = image if self.light is None else self.light.removed_from(image, mask, dpi, top).image
        return image if self.white is None else self.white.balanced(image, mask)


def _shade(
    prepared: Prepared,
    fine: FlatMesh,
    painting: Painting,
    registered: Sequence[Registered],
    settings: Settings,
    dpi: float,
) -> Shaded:
    """Remove light and the lamp's colour from a page, as far as settings and page allow."""
    image, mask = painting.image, painting.mask
    removed, balanced = None, None
    light: LightReport = {}
    white: WhiteReport = {"setting": "keep"}
    if fine.texture is not None and settings.shading != "keep":
        relief = relief_of(fine, prepared.normals_on, LIGHT_DPI)
        painted = _paint(prepared, fine, registered, LIGHT_DPI)
        cells = seen_part(painted.painting, painted.coverage)
        removed = remove_registered_shading(fine, registered, relief, cells, painting, dpi)
        image, light = removed.image, removed.report
    if fine.texture is not None and settings.white_balance != "keep":
        balanced = balance_on_paper(image, mask, dpi)
        image, white = balanced.image, {"setting": settings.white_balance, **balanced.report}
    kept = (("light_kept", light.get("reason")), ("white_kept", white.get("reason")))
    found = tuple(Finding.of(code, reason=reason) for code, reason in kept if reason is not None)
    return Shaded(
        image, {"light": light, "white_balance": white}, found, None if removed is None else removed.light, balanced
    )


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
