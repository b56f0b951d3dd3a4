"""Several views of one page on a turntable.

The stages: rotate → capture → store each → merge → restore.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

import drivers
from drivers import Scanner
from drivers.stage import RotaryStage
from restore import BadInput, RangeScan, RotationAxis, fit_axis, load_scan, merge_views, save_scan
from station.config import AxisSettings, StationConfig, TurntableSettings
from station.errors import UsageError
from station.progress import Progress, silent
from station.run.destination import Clock, Destination, Outcome, SourceRecord
from station.run.one_page import scan_folders, stem_of, store_and_restore
from station.run.options import RunOptions
from station.run.shots import range_image_of
from station.storage.atomic import lock_output_folder, new_folder, refuse_existing, write_all
from station.storage.folder_lock import FolderLock, recover

VIEW = "-view-"  # between the stem and the number of a view
AXIS_FILE = "axis.toml"
FULL_TURN_DEG = 360.0
NO_STAGE = "add a table [turntable], as in configs/simulated-turntable.toml"
NO_AXIS = "find it with `planish axis`, and put the table [turntable.axis] that it writes into the configuration"


@dataclass(frozen=True, eq=False)
class Views:
    """Captured views: scans, their stored folders, and turntable angles, degrees."""

    scans: Sequence[RangeScan]
    folders: Sequence[Path]
    turns_deg: Sequence[float]


def scan_views(
    config: StationConfig,
    destination: Destination,
    options: RunOptions,
    *,
    turns: int,
    progress: Progress = silent,
    clock: Clock = perf_counter,
) -> Outcome:
    """Capture `turns` views, merge them, restore the page.

    Each is stored in `<stem>-view-<n>.scan` at once. Raises UsageError or OverwriteError before any work, ScannerError,
    NotEnoughSurface, OSError when the disk refuses.
    """
    stem, options = config.output.stem, replace(options, settings=config.restore).with_implied_outputs()
    settings = _require_axis(_require_stage(config))
    recover(destination.folder)
    scan_folders(destination, [stem])
    refuse_existing(destination.files(stem, options), force=destination.force)
    start = clock()
    with lock_output_folder(destination.folder) as lock:
        views = capture_views(config, destination, stem, lock=lock, turns=turns, progress=progress)
        seconds = {"load": 0.0, "capture": clock() - start}
        axis = _rotation_axis(settings.point_mm, settings.direction)
        return _merge_and_restore(
            views, axis, destination, options, stem, seconds, lock=lock, progress=progress, clock=clock
        )


def merge_files(
    folders: Sequence[Path],
    destination: Destination,
    options: RunOptions,
    *,
    progress: Progress = silent,
    clock: Clock = perf_counter,
) -> Outcome:
    """Merge views that `scan_views` stored, and restore the page.

    Raises as `restore_file`, and BadInput for a scan that is not such a view.
    """
    stem = stem_of(folders[0]).split(VIEW)[0]
    recover(destination.folder)
    scan_folders(destination, [stem])
    refuse_existing(destination.files(stem, options), force=destination.force)
    start = clock()
    scans = [_stored_view(folder) for folder in folders]
    turned = [scan.provenance["turntable"] for scan in scans]
    views = Views(scans, folders, [turn["deg"] for turn in turned])
    axis = _rotation_axis(turned[0]["axis"]["point_mm"], turned[0]["axis"]["direction"])
    seconds = {"load": clock() - start}
    with lock_output_folder(destination.folder) as lock:
        return _merge_and_restore(
            views, axis, destination, options, stem, seconds, lock=lock, progress=progress, clock=clock
        )


def find_axis(
    config: StationConfig, destination: Destination, *, turns: int, progress: Progress = silent
) -> tuple[str, Path]:
    """Find the turntable's axis from views of a marker board, and write `axis.toml`.

    Returns it as a table of the configuration, and the path. Raises as `scan_views`, and BadInput when the board cannot
    be found or the turntable did not reach the commanded angles.
    """
    path = destination.folder / AXIS_FILE
    recover(destination.folder)
    refuse_existing([path], force=destination.force)
    with lock_output_folder(destination.folder) as lock:
        views = capture_views(config, destination, "axis", lock=lock, turns=turns, progress=progress)
        fit = fit_axis(views.scans, views.turns_deg)
        table = axis_table(fit.axis, fit.rms_mm)
        write_all([(path, table.encode())], force=destination.force, lock=lock)
    return table, path


def axis_table(axis: RotationAxis, rms_mm: float) -> str:
    """An axis as a table of the configuration; rms_mm: the residual of its fit."""
    point, direction = (", ".join(f"{x:.6g}" for x in vector) for vector in (axis.point, axis.direction))
    return f"[turntable.axis]  # corners lie {rms_mm:.3f} mm rms off\npoint_mm = [{point}]\ndirection = [{direction}]\n"


def view_angles(turns: int, arc_deg: float) -> list[float]:
    """Return the angles of the views, degrees.

    Evenly over a full rotation, or over an arc from 0 to both sides alternately.
    """
    if arc_deg == FULL_TURN_DEG:
        return [index * FULL_TURN_DEG / turns for index in range(turns)]
    step = arc_deg / max(turns - 1, 1)
    return [step * ((index + 1) // 2) * (1 if index % 2 else -1) for index in range(turns)]


def capture_views(
    config: StationConfig, destination: Destination, stem: str, *, lock: FolderLock, turns: int, progress: Progress
) -> Views:
    """Rotate, capture and store `turns` views. Stored views survive every later error.

    Raises UsageError or OverwriteError before any work, ScannerError, OSError when the disk refuses.
    """
    stage = _require_stage(config)
    folders = scan_folders(destination, [f"{stem}{VIEW}{number}" for number in range(1, turns + 1)])
    scans: list[RangeScan] = []
    turned: list[float] = []

    def store_view(angle_deg: float, scan: RangeScan) -> None:
        turned.append(angle_deg)
        scans.append(
            replace(scan, provenance={**scan.provenance, "turntable": _rotation_record(angle_deg, stage.axis)})
        )
        with new_folder(lock, folders[len(scans) - 1].name) as folder:
            save_scan(scans[-1], folder)

    try:
        with _open_turntable(config, stage) as (scanner, rotary):
            rotary.start()
            for angle in view_angles(turns, stage.arc_deg):
                reached = rotary.turn_to(angle)
                store_view(reached, range_image_of(scanner.capture(config.capture, progress), "a turntable"))
            rotary.finish()
    except drivers.SettingsError as error:
        raise UsageError(f"configuration: {error}", error.hint) from error
    except BaseException as error:
        if scans:
            error.add_note(_recovery_hint(folders[: len(scans)], destination, merge=stage.axis is not None))
        raise
    return Views(scans, folders, turned)


def _open_turntable(
    config: StationConfig, stage: TurntableSettings
) -> AbstractContextManager[tuple[Scanner, RotaryStage]]:
    return drivers.open_turntable(config.scanner, model=stage.model, port=stage.port, relative=stage.relative)


def _merge_and_restore(
    views: Views,
    axis: RotationAxis,
    destination: Destination,
    options: RunOptions,
    stem: str,
    seconds: Mapping[str, float],
    *,
    lock: FolderLock,
    progress: Progress,
    clock: Clock,
) -> Outcome:
    start = clock()
    progress("merge", 0.0)
    try:
        merged = merge_views(views.scans, views.turns_deg, axis)
    except BaseException as error:
        error.add_note(_recovery_hint(views.folders, destination, merge=True))
        raise
    progress("merge", 1.0)
    report_fields = {"views": [str(folder) for folder in views.folders]}
    source_record = SourceRecord(report_fields, {**seconds, "merge": clock() - start}, merged.findings)
    return store_and_restore(
        [merged.scan],
        scan_folders(destination, [stem]),
        destination,
        options,
        stem,
        source_record,
        lock=lock,
        progress=progress,
        clock=clock,
    )


def _require_stage(config: StationConfig) -> TurntableSettings:
    if config.turntable is None:
        raise UsageError("the configuration has no turntable", NO_STAGE)
    return config.turntable


def _require_axis(stage: TurntableSettings) -> AxisSettings:
    if stage.axis is None:
        raise UsageError("the configuration does not say where the stage's axis is", NO_AXIS)
    return stage.axis


def _rotation_axis(point_mm: Sequence[float], direction: Sequence[float]) -> RotationAxis:
    along = np.asarray(direction, float)
    return RotationAxis(np.asarray(point_mm, float), along / np.linalg.norm(along))


def _rotation_record(angle_deg: float, axis: AxisSettings | None) -> dict[str, Any]:
    """The provenance of a view that merging needs: stage angle in degrees and axis."""
    return {"deg": angle_deg, "axis": None if axis is None else axis.model_dump(mode="json")}


def _stored_view(folder: Path) -> RangeScan:
    scan = load_scan(folder)
    if not isinstance(scan, RangeScan) or not (scan.provenance.get("turntable") or {}).get("axis"):
        raise BadInput(f"{folder} is not a view that was taken on a turntable", "give folders named *-view-*.scan")
    return scan


def _recovery_hint(folders: Sequence[Path], destination: Destination, *, merge: bool) -> str:
    names = [str(folder) for folder in folders]
    verb = "merge" if merge and len(names) > 1 else "restore"
    again = shlex.join(["planish", verb, *(names if verb == "merge" else names[:1]), "-o", str(destination.folder)])
    return f"{len(names)} views are safe, {names[0]} the first; {verb} with: {again}"
