"""One page: open the scanner → capture → store → restore → export."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from time import perf_counter
from typing import Any

import drivers
from restore import Photograph, RangeScan, Settings, SurfaceMesh, read_photograph, restore
from restore.errors import BadInput
from restore.formats import load_scan, save_scan, scan_stem
from station import export
from station.config import StationConfig
from station.errors import UsageError
from station.export.atomic import new_folder, refuse_existing, writable, write_all
from station.export.report import finite
from station.originals import check_outputs
from station.pictures.frames import Recorder
from station.progress import Progress, silent

SCAN_SUFFIX = ".scan"

Clock = Callable[[], float]


@dataclass(frozen=True)
class Destination:
    """Where a run writes and what. kinds: those of `export.OUTPUTS` on top of the page and its report."""

    folder: Path
    kinds: frozenset[str] = frozenset()
    force: bool = False

    def files(self, stem: str, *, colour: bool = True) -> list[Path]:
        """The files that a run writes, the report last. colour: whether the scan has a colour image."""
        return [self.folder / name for name in export.names(stem, self.kinds, colour=colour)]


@dataclass(frozen=True)
class Outcome:
    """The report of a run and the files that it wrote."""

    report: Mapping[str, Any]
    files: tuple[Path, ...]


@dataclass(frozen=True)
class Origin:
    """What goes before the restoration: what the report says of it, the seconds of each stage, what is to be told."""

    facts: Mapping[str, Any]
    seconds: Mapping[str, float]
    warnings: tuple[str, ...] = ()


def restore_file(
    source: Path,
    destination: Destination,
    *,
    settings: Settings,
    texture: Path | None = None,
    photos: Sequence[Path] = (),
    progress: Progress = silent,
    clock: Clock = perf_counter,
) -> Outcome:
    """Restore a stored scan, painted from photographs of the page where there are any that can be used.

    Raises OverwriteError or UsageError before any work, BadInput, NotEnoughSurface, OSError when the disk refuses.
    """
    stem = stem_of(source)
    originals = [source, *([] if texture is None else [texture]), *photos]
    check_outputs(destination.files(stem), originals, force=destination.force)
    start = clock()
    try:
        photographs = [read_photograph(path) for path in photos]
        scan = load_scan(source, texture=texture)
    except OSError as error:
        raise BadInput(f"cannot read {error.filename or source}: {error.strerror}", "check the path") from error
    facts = {"scan": str(source)} | ({} if texture is None else {"texture": str(texture)})
    origin = Origin(facts, {"load": clock() - start})
    with writable(destination.folder):
        return _restore(
            scan, destination, stem, origin, settings=settings, photos=photographs, progress=progress, clock=clock
        )


def scan_page(
    config: StationConfig, destination: Destination, *, progress: Progress = silent, clock: Clock = perf_counter
) -> Outcome:
    """Capture a page, store the scan in `<stem>.scan`, then restore it. What was captured outlives every later fault.

    Raises OverwriteError or UsageError before any work, ScannerError, NotEnoughSurface, OSError when the disk refuses.
    """
    stem = config.output.stem
    stored = destination.folder / (stem + SCAN_SUFFIX)
    refuse_existing([stored, *destination.files(stem)], force=destination.force)
    with writable(destination.folder):
        start = clock()
        scan = _capture(config, progress)
        origin = Origin({}, {"load": 0.0, "capture": clock() - start})
        return keep_and_restore(
            scan, destination, stem, origin, settings=config.restore, progress=progress, clock=clock
        )


def keep_and_restore(
    scan: RangeScan,
    destination: Destination,
    stem: str,
    origin: Origin,
    *,
    settings: Settings,
    progress: Progress,
    clock: Clock,
) -> Outcome:
    """Store a scan in `<stem>.scan`, then restore it. The scan outlives every later fault.

    Raises OverwriteError, NotEnoughSurface, OSError when the disk refuses.
    """
    stored = destination.folder / (stem + SCAN_SUFFIX)
    start = clock()
    with new_folder(stored, force=destination.force) as folder:
        save_scan(scan, folder)
    facts, seconds = {"scan": str(stored), **origin.facts}, {**origin.seconds, "store": clock() - start}
    origin = replace(origin, facts=facts, seconds=seconds)
    try:
        outcome = _restore(scan, destination, stem, origin, settings=settings, progress=progress, clock=clock)
    except BaseException as error:
        force = ["--force"] if destination.force else []
        again = shlex.join(["planish", "restore", str(stored), "-o", str(destination.folder), *force])
        error.add_note(f"the scan is safe in {stored}; restore it with: {again}")
        raise
    return replace(outcome, files=(stored, *outcome.files))


def stem_of(source: Path) -> str:
    """A scan file's name without the endings of its format (book.abs.gz → book), a scan folder's without `.scan`."""
    if source.is_dir():
        name = source.resolve().name
        return name.removesuffix(SCAN_SUFFIX) or name
    return scan_stem(source)


def _capture(config: StationConfig, progress: Progress) -> RangeScan:
    try:
        scanner = drivers.open_scanner(config.scanner)
    except drivers.SettingsError as error:
        raise UsageError(f"configuration: {error}", error.hint) from error
    with scanner:
        return scanner.capture(config.capture, progress)


def _restore(
    scan: RangeScan | SurfaceMesh,
    destination: Destination,
    stem: str,
    origin: Origin,
    *,
    settings: Settings,
    photos: Sequence[Photograph] = (),
    progress: Progress,
    clock: Clock,
) -> Outcome:
    recorder = Recorder() if "frames" in destination.kinds else None
    start = clock()
    page = restore(scan, settings, photos=photos, progress=progress, on_step=recorder)
    seconds = {**origin.seconds, **page.report["seconds"]}
    seconds["total"] = sum(origin.seconds.values()) + clock() - start
    files = destination.files(stem, colour=page.flat.texture is not None)
    names = [path.name for path in files]
    told = {"seconds": seconds, "peak_memory_mb": _peak_mb(), "files": names}
    told["warnings"] = [*page.report.get("warnings", ()), *origin.warnings]
    report = finite({**page.report, **origin.facts, **told})
    done = export.Restoration(stem, page, scan, recorder.frames() if recorder else (), report)
    contents = export.encoded(done, destination.kinds)
    written = write_all(zip(files, contents, strict=True), force=destination.force)
    return Outcome(report, tuple(written))


def _peak_mb() -> float:
    """The most memory that the process ever held, MB of 2^20 bytes."""
    return getrusage(RUSAGE_SELF).ru_maxrss / 1024  # Linux counts in KiB
