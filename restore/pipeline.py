"""One scan, from the range grid to the page: prepare → unroll (decimate, flatten, refine) → texture → shade."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from restore.flatten import OnStep
from restore.prepare import prepare
from restore.relief import relief_of
from restore.report import describe
from restore.scan import RangeScan, RestoredPage, SurfaceMesh
from restore.settings import Settings
from restore.shade import LIGHT_DPI, Evened, remove_shading
from restore.surface import Sheet
from restore.texture import Painting, paint_page
from restore.unroll import Unrolled, unroll

STAGES = ("prepare", "decimate", "flatten", "refine", "texture", "shade")

Progress = Callable[[str, float], None]


def restore(
    scan: RangeScan | SurfaceMesh,
    settings: Settings | None = None,
    *,
    progress: Progress | None = None,
    on_step: OnStep | None = None,
) -> RestoredPage:
    """Turn a scan of a warped page into the flat page.

    progress(stage, fraction done) is called as the work goes on; on_step(step, positions (n, 3) mm, faces (m, 3)) after
    every time step of the flattening.
    Raises NotEnoughSurface when there is no page in the scan, BadInput when the scan cannot be used.
    """
    settings = settings or Settings()
    clock = Stopwatch(progress)
    with clock("prepare"):
        surface = prepare(scan)
    unrolled = unroll(surface, settings, clock, on_step)
    with clock("texture"):
        painting = paint_page(unrolled.fine, settings.dpi)
    with clock("shade"):
        evened = _evened(surface, unrolled, painting, settings)
    report = describe(surface, unrolled, painting, settings)
    report |= {"light": evened.facts, "source": dict(scan.provenance), "seconds": clock.seconds}
    found = unrolled.coarse, report, painting.source, unrolled.fine
    return RestoredPage(evened.image, settings.dpi, painting.mask, *found, painting.image)


def _evened(surface: Sheet | SurfaceMesh, unrolled: Unrolled, painting: Painting, settings: Settings) -> Evened:
    """The page without its light, or as it is when that is wanted or there is no picture of it."""
    if settings.shading == "keep" or unrolled.fine.texture is None:
        return Evened(painting.image, {})
    relief = relief_of(surface, unrolled.fine, min(LIGHT_DPI, settings.dpi))
    return remove_shading(painting.image, painting.mask, settings.dpi, relief)


class Stopwatch:
    """Times the stages and tells the progress of each."""

    def __init__(self, progress: Progress | None) -> None:
        self.seconds = dict.fromkeys(STAGES, 0.0)
        self._progress = progress

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        self._tell(stage, 0.0)
        start = time.perf_counter()
        yield
        self.seconds[stage] = time.perf_counter() - start
        self._tell(stage, 1.0)

    def _tell(self, stage: str, done: float) -> None:
        if self._progress:
            self._progress(stage, done)
