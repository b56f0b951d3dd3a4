"""A page from photographs alone: read → reconstruct → restore → export."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from pathlib import Path
from time import perf_counter

from restore import BadInput, ScaleCard, Settings, SurfaceMesh, read_photographs, reconstruct_page, restore
from station.errors import UsageError
from station.progress import Progress, silent
from station.run.destination import Clock, Destination, Outcome, SourceRecord
from station.run.one_page import Examine, nothing, restore_scan
from station.run.options import RunOptions
from station.run.overall_progress import expected_of_photographs, with_whole
from station.run.overwrite_check import check_outputs
from station.storage.atomic import lock_output_folder
from station.storage.folder_lock import recover

SIZE = re.compile(r"(?P<width>\d+(\.\d+)?)\s*[x×]\s*(?P<height>\d+(\.\d+)?)")
MEASURED = Settings(points=300, dpi=30)  # enough to tell the size of a page to a tenth of a millimetre
OTHER_SHAPE = 0.01  # of the ratio of the sides: a page is measured better than that, and a wrong size is not meant


@dataclass(frozen=True)
class Scale:
    """Where the scale of photographs comes from: the card, the size of the page in mm, or neither."""

    card: bool = True
    page_mm: tuple[float, float] | None = None

    @classmethod
    def parse(cls, text: str) -> Scale:
        """The scale that an option names. Raises UsageError for another text."""
        if text in ("card", "none"):
            return cls(card=text == "card")
        size = SIZE.fullmatch(text.strip().lower())
        if size is None or not min(float(size["width"]), float(size["height"])) > 0:
            raise UsageError(f"--scale: {text!r} is no scale", "give card, none, or the page's width × height: 210x297")
        return cls(card=False, page_mm=(float(size["width"]), float(size["height"])))


def photographed_page(
    pictures: Sequence[Path],
    destination: Destination,
    options: RunOptions,
    *,
    stem: str | None = None,
    examine: Examine = nothing,
    progress: Progress = silent,
    clock: Clock = perf_counter,
) -> Outcome:
    """Restore the page that photographs show, painted from them.

    pictures: the photographs, or one video. stem, examine: as `restore_file` has them.
    Raises OverwriteError or UsageError before any work, BadInput, NotEnoughSurface, OSError when the disk refuses.
    """
    scale = Scale() if options.scale is None else Scale.parse(options.scale)
    stem, options = stem or pictures[0].stem, options.with_implied_outputs()
    recover(destination.folder)
    check_outputs(destination.files(stem, options), list(pictures), force=destination.force)
    start = clock()
    photographs = read_photographs(pictures, progress)
    loaded = clock()
    progress = with_whole(progress, expected_of_photographs(len(photographs)))
    page = reconstruct_page(photographs, card=ScaleCard() if scale.card else None, progress=progress)
    findings = page.findings
    if scale.page_mm is not None:
        factor = _factor_to(page.mesh, scale.page_mm)
        page, findings = page.rescale_page(factor, {"from": "page", "page_mm": list(scale.page_mm)}), ()
    record = SourceRecord(
        {"photographs": [str(path) for path in pictures], "photogrammetry": dict(page.report)},
        {"load": loaded - start, "reconstruct": clock() - loaded},
        findings,
    )
    with lock_output_folder(destination.folder) as lock:
        return restore_scan(
            page.mesh,
            destination,
            options,
            stem,
            record,
            lock=lock,
            photos=page.photographs,
            input_files=pictures,
            examine=examine,
            progress=progress,
            clock=clock,
        )


def _factor_to(page: SurfaceMesh, wanted: tuple[float, float]) -> float:
    """The factor by which a page is to be larger, to be width × height mm either way round.

    Raises BadInput when its sides have another ratio.
    """
    width, height = restore(page, MEASURED).report["page_mm"]
    ratio, known = max(width, height) / min(width, height), max(wanted) / min(wanted)
    if abs(ratio / known - 1) > OTHER_SHAPE:
        raise BadInput(
            f"the page's sides are as {ratio:.3f} to 1, and those of {wanted[0]:g} × {wanted[1]:g} mm as {known:.3f}",
            "measure the page, or give --scale card or none",
        )
    return sqrt(wanted[0] * wanted[1] / (width * height))
