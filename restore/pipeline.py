"""One scan, from the range grid to the page: prepare → unroll (decimate, flatten, refine) → texture → shade."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from restore.flatten import OnStep
from restore.prepare import prepare
from restore.report import describe
from restore.scan import RangeScan, RestoredPage, SurfaceMesh
from restore.settings import Settings
from restore.shade import remove_shading
from restore.texture import paint_page
from restore.unroll import unroll

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
        image = painting.image
        if settings.shading == "remove":
            image = remove_shading(image, painting.mask, settings.dpi)
    report = describe(surface, unrolled, painting, settings)
    report |= {"source": dict(scan.provenance), "seconds": clock.seconds}
    return RestoredPage(image, settings.dpi, painting.mask, unrolled.coarse, report, painting.source, unrolled.fine)


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
