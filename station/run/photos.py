"""A page from photographs alone: read → reconstruct → restore → export."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

from restore import ScaleCard, read_photographs, reconstruct_page
from station.progress import Progress, silent
from station.run.destination import Clock, Destination, Outcome, SourceRecord
from station.run.one_page import Examine, nothing, restore_scan
from station.run.options import RunOptions
from station.run.overall_progress import expected_of_photographs, with_whole
from station.run.overwrite_check import check_outputs
from station.run.scale import Scale, factor_to
from station.storage.atomic import lock_output_folder
from station.storage.folder_lock import recover


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
        factor = factor_to(page.mesh, scale.page_mm)
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
