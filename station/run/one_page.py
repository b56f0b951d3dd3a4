"""One page: open the scanner → capture → store → restore → export."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from time import perf_counter
from typing import Any

import drivers
from drivers.scanner import ScanFile, Shot
from restore import (
    BadInput,
    Finding,
    Photograph,
    RangeScan,
    RestoredPage,
    RestoreError,
    Settings,
    SurfaceMesh,
    load_capture,
    load_scan,
    mirror_page,
    read_photographs,
    restore,
    save_scan,
    super_resolve,
)
from restore.formats import referenced_files, scan_stem
from station.choices import Layout, Rotation
from station.config import StationConfig
from station.errors import UsageError
from station.images.conversion import convert_to_srgb
from station.page_files import outputs
from station.page_files.report import finite
from station.pictures.frames import Recorder
from station.progress import Progress, silent
from station.run.destination import Clock, Destination, Outcome, SourceRecord
from station.run.options import RunOptions
from station.run.overwrite_check import check_outputs, superseded, superseded_pieces
from station.run.peak_memory import peak_memory_mib
from station.run.pieces import Selected, select_leaves, select_sheets
from station.run.plausibility import check_plausible_page
from station.run.scale import page_size_of, scaled_to
from station.run.shots import read_shot
from station.storage.atomic import lock_output_folder, new_folder, refuse_captured, refuse_existing, write_all
from station.storage.disk import Contents, copy_file
from station.storage.folder_lock import FolderLock, recover
from station.words.orientation import turned
from station.words.words import check_language, find_tesseract, findings_of_words, recognise
from station.words.words_lost import words_lost

SCAN_SUFFIX = ".scan"

# A restored page and its scan → further fields of the report.
Examine = Callable[[RestoredPage, RangeScan | SurfaceMesh], Mapping[str, Any]]


def nothing(_page: RestoredPage, _scan: RangeScan | SurfaceMesh) -> Mapping[str, Any]:
    """No further fields."""
    return {}


def restore_file(
    source: Path,
    destination: Destination,
    options: RunOptions,
    *,
    texture: Path | None = None,
    photos: Sequence[Path] = (),
    shots: Sequence[Path] = (),
    facts: Mapping[str, Any] | None = None,
    stem: str | None = None,
    examine: Examine = nothing,
    progress: Progress = silent,
    clock: Clock = perf_counter,
) -> Outcome:
    """Restore a stored scan, textured from photographs where possible.

    shots: further captures of the same page; they make its colour image finer.
    facts: further fields of the report, which replace those of the same name.
    stem: first part of the files' names; that of the scan's own name by default.
    examine: looks at each page before it is written, and returns further fields of its report.
    Raises OverwriteError or UsageError before any work, BadInput, NotEnoughSurface, OSError when the disk refuses.
    """
    _check_programs(options)
    page_mm = None if options.scale is None else page_size_of(options.scale)
    recover(destination.folder)
    stem, options = stem or stem_of(source), options.with_implied_outputs()
    input_files = [source, *([] if texture is None else [texture]), *photos, *shots]
    if destination.force:  # without it nothing at all is overwritten
        input_files += [file for scan in (source, *shots) for file in referenced_files(scan)]
    check_outputs(destination.files(stem, options), input_files, force=destination.force)
    start = clock()
    try:
        photographs = read_photographs(photos)
        capture = load_capture(source, texture, unit=options.unit, grid=options.grid, depth=options.depth)
        if shots and capture.photographs:
            raise UsageError(f"{source} has its own photographs", "leave --extra-scan out; --photo adds another")
        if page_mm is not None and capture.photographs:
            raise UsageError(f"{source} has its own scale", "leave --scale out")
        scan = _combined_shots([capture.scan, *(load_scan(shot) for shot in shots)])
    except OSError as error:
        raise BadInput(f"cannot read {error.filename or source}: {error.strerror}", "check the path") from error
    report_fields: dict[str, Any] = {"scan": str(source)} | ({} if texture is None else {"texture": str(texture)})
    report_fields |= {"extra_scans": [str(shot) for shot in shots]} if shots else {}
    report_fields |= facts or {}
    if page_mm is not None:
        scan = scaled_to(scan, page_mm, options.sheets)
        report_fields["scale"] = options.scale
    source_record = SourceRecord(report_fields, {"load": clock() - start})
    with lock_output_folder(destination.folder) as lock:
        return restore_scan(
            scan,
            destination,
            options,
            stem,
            source_record,
            lock=lock,
            photos=[*capture.photographs, *photographs],
            input_files=input_files,
            examine=examine,
            progress=progress,
            clock=clock,
        )


def scan_page(
    config: StationConfig,
    destination: Destination,
    options: RunOptions,
    *,
    shots: int = 1,
    progress: Progress = silent,
    clock: Clock = perf_counter,
) -> Outcome:
    """Capture a page, store the scan in `<stem>.scan`, then restore it.

    Stored scans survive every later error. Of several captures, which make the colour image finer, the further ones are
    stored in `<stem>-2.scan` and so on. A scan of an earlier run is never replaced: the new one is then stored in
    `<stem>.2.scan`. The settings are those of the configuration.
    Raises OverwriteError or UsageError before any work, ScannerError, NotEnoughSurface, OSError when the disk refuses.
    """
    _check_programs(options)
    stem, options = config.output.stem, replace(options, settings=config.restore).with_implied_outputs()
    recover(destination.folder)
    places = scan_folders(destination, [stem, *(f"{stem}-{i + 1}" for i in range(1, shots))])
    refuse_existing(destination.files(stem, options), force=destination.force)
    with lock_output_folder(destination.folder) as lock:
        start = clock()
        captured = _capture(config, shots, progress)
        source_record = SourceRecord({}, {"load": 0.0, "capture": clock() - start})
        return store_and_restore(
            captured, places, destination, options, stem, source_record, lock=lock, progress=progress, clock=clock
        )


def store_and_restore(
    shots: Sequence[Shot],
    folders: Sequence[Path],
    destination: Destination,
    options: RunOptions,
    stem: str,
    source_record: SourceRecord,
    *,
    lock: FolderLock,
    progress: Progress,
    clock: Clock,
) -> Outcome:
    """Store a scan and further captures, then restore it.

    They are stored in the folders, a file of the scanner's own as it came, and survive every later error. Raises
    OverwriteError, NotEnoughSurface, BadInput for a file that cannot be read, OSError when the disk refuses.
    """
    start = clock()
    scans = [read_shot(shot) for shot in shots]
    stored = [_store(shot, path, lock) for shot, path in zip(shots, folders, strict=True)]
    report_fields, seconds = (
        {"scan": str(stored[0]), **source_record.report_fields},
        {**source_record.seconds, "store": clock() - start},
    )
    source_record = replace(source_record, report_fields=report_fields, seconds=seconds)
    try:
        scan = _combined_shots(scans)
        outcome = restore_scan(
            scan, destination, options, stem, source_record, lock=lock, progress=progress, clock=clock
        )
    except BaseException as error:
        force = ["--force"] if destination.force else []
        again = shlex.join(
            [
                "planish",
                "restore",
                str(stored[0]),
                *_reading(shots[0]),
                *_options(stored[1:]),
                "-o",
                str(destination.folder),
                *force,
            ]
        )
        error.add_note(f"the scan is safe in {stored[0]}; restore it with: {again}")
        raise
    return replace(outcome, files=(*stored, *outcome.files))


def _store(shot: Shot, path: Path, lock: FolderLock) -> Path:
    """Store a shot in a new folder; return the path of the scan in it, for `load_scan`."""
    with new_folder(lock, path.name) as folder:
        if not isinstance(shot, ScanFile):
            save_scan(shot, folder)
            return path
        here = shot.path.resolve().parent
        for file in (shot.path.resolve(), *referenced_files(shot.path)):
            target = folder / file.relative_to(here)
            target.parent.mkdir(parents=True, exist_ok=True)
            copy_file(file, target)
    shot.discard()
    return path / shot.path.name


def stem_of(source: Path) -> str:
    """Return a scan's name without the endings of its format.

    book.abs.gz → book; a scan folder's without `.scan`.
    """
    if source.is_dir():
        name = source.resolve().name
        return name.removesuffix(SCAN_SUFFIX) or name
    return scan_stem(source)


def _check_programs(options: RunOptions) -> None:
    if "ocr" in options.outputs:
        check_language(find_tesseract(), options.language)
    if options.rotate == Rotation.AUTO:
        find_tesseract()


def scan_folders(destination: Destination, names: Sequence[str]) -> list[Path]:
    """Return the folders of the scans that a run captures.

    `<name>.scan`, or with `force` the first number that is free. Raises OverwriteError when one exists and `force` is
    not set.
    """
    for number in count(1):
        suffix = SCAN_SUFFIX if number == 1 else f".{number}{SCAN_SUFFIX}"
        folders = [destination.folder / (name + suffix) for name in names]
        if not destination.force:
            refuse_captured(folders)
        if not any(os.path.lexists(folder) for folder in folders):
            return folders
    raise AssertionError  # count never ends


def _options(shots: Sequence[Path]) -> list[str]:
    return [word for shot in shots for word in ("--extra-scan", str(shot))]


def _reading(shot: Shot) -> list[str]:
    reading = shot.reading if isinstance(shot, ScanFile) else {}
    return [word for name, value in reading.items() if value != "auto" for word in (f"--{name}", value)]


def _combined_shots(shots: Sequence[RangeScan | SurfaceMesh]) -> RangeScan | SurfaceMesh:
    """One scan with the colour image reconstructed from all shots."""
    if len(shots) == 1:
        return shots[0]
    scans = [shot for shot in shots if isinstance(shot, RangeScan)]
    if len(scans) < len(shots):
        raise BadInput(
            "a mesh is not a capture of the scanner", "give scans as the scanner made them with --extra-scan"
        )
    return super_resolve(scans)


def _capture(config: StationConfig, shots: int, progress: Progress) -> list[Shot]:
    try:
        scanner = drivers.open_scanner(config.scanner)
    except drivers.SettingsError as error:
        raise UsageError(f"configuration: {error}", error.hint) from error
    with scanner:
        return [scanner.capture(config.capture, progress) for _ in range(shots)]


def restore_scan(
    scan: RangeScan | SurfaceMesh,
    destination: Destination,
    options: RunOptions,
    stem: str,
    source_record: SourceRecord,
    *,
    lock: FolderLock,
    photos: Sequence[Photograph] = (),
    input_files: Sequence[Path] = (),
    examine: Examine = nothing,
    progress: Progress,
    clock: Clock,
) -> Outcome:
    """Restore the sheets of a scan, textured from photographs if any, and write them."""
    start = clock()
    if options.layout == Layout.SINGLE and options.edits is None:
        sheets = select_sheets(scan, options.sheets, both_leaves=options.both_leaves)
    else:
        sheets = select_leaves(scan, options)
    source_record = replace(source_record, seconds={**source_record.seconds, "separate": clock() - start})
    if len(sheets) > 1:
        planned = [path for sheet in sheets for path in destination.files(stem + sheet.suffix, options)]
        check_outputs(planned, input_files, force=destination.force)
    pages: list[Outcome] = []
    failures: list[tuple[Selected, RestoreError]] = []

    def contents() -> Iterator[tuple[Path, Contents]]:
        for sheet in sheets:
            try:
                restoration = _restore_sheet(
                    sheet,
                    destination,
                    options,
                    stem,
                    source_record,
                    photos=photos,
                    examine=examine,
                    progress=progress,
                    clock=clock,
                )
            except RestoreError as error:
                failures.append((sheet, error))
                continue
            files = destination.files(restoration.stem, options, restoration.page)
            pages.append(Outcome(restoration.report, tuple(files)))
            yield from zip(files, outputs.encode_outputs(restoration, options.outputs), strict=True)
        if not pages:
            raise failures[0][1]

    gone: list[Path] = []
    if destination.force:
        possible = [destination.folder / name for name in outputs.names(stem, outputs.KINDS)]
        gone = superseded(destination.folder / f"{stem}.json", possible, input_files)
        gone += superseded_pieces(destination.folder, stem, str(source_record.report_fields.get("scan")), input_files)
    written = tuple(write_all(contents(), force=destination.force, lock=lock, superseded=gone))
    if len(sheets) == 1:
        return replace(pages[0], files=written)
    left_out = [{**_name_of(sheet), "reason": str(error)} for sheet, error in failures]
    return Outcome({"sheets": [page.report for page in pages], "rejected": left_out}, written, tuple(pages))


def _name_of(sheet: Selected) -> dict[str, Any]:
    """Return the report's name of a sheet that is not a page: number, or side of the gutter."""
    fields = sheet.report_fields
    return dict(fields["sheet"]) if "sheet" in fields else {"part": fields["part"]}


def _restore_sheet(
    sheet: Selected,
    destination: Destination,
    options: RunOptions,
    stem: str,
    source_record: SourceRecord,
    *,
    photos: Sequence[Photograph],
    examine: Examine,
    progress: Progress,
    clock: Clock,
) -> outputs.Restoration:
    """One sheet restored, its words read when they are asked for, with its report."""
    recorder = Recorder() if options.outputs & {"frames", "model"} else None
    start, stem = clock(), stem + sheet.suffix
    settings = sheet.settings or options.settings
    again = partial(_turned_page, sheet, options, photos=photos, progress=progress, recorder=recorder)
    page, word_findings = again(settings)
    seconds = {**source_record.seconds, **page.report["seconds"]}
    words = None
    if "ocr" in options.outputs:
        before = clock()
        words = recognise(page.image, page.dpi, name=f"{stem}.png", language=options.language)
        lost = words_lost(page, words, language=options.language)
        if lost:
            page, word_findings = again(settings.model_copy(update={"shading": "keep"}))
            words = recognise(page.image, page.dpi, name=f"{stem}.png", language=options.language)
        word_findings += (*lost, *findings_of_words(words))
        seconds["ocr"] = clock() - before
    seconds["total"] = sum(source_record.seconds.values()) + clock() - start
    names = [path.name for path in destination.files(stem, options, page)]
    found = [*page.findings, *source_record.findings, *sheet.findings, *word_findings]
    run_fields = {"seconds": seconds, "peak_memory_mb": peak_memory_mib(), "files": names, **sheet.report_fields}
    findings = {"findings": [one.as_json() for one in found]}
    fields = {**page.report, **source_record.report_fields, **run_fields, **findings, **examine(page, sheet.scan)}
    report = finite(fields)
    frames = recorder.frames() if recorder else ()
    colours = None if options.to_srgb else options.colours
    return outputs.Restoration(stem, page, sheet.scan, frames, report, words, colours, options.colours)


def _turned_page(
    sheet: Selected,
    options: RunOptions,
    settings: Settings,
    *,
    photos: Sequence[Photograph],
    progress: Progress,
    recorder: Recorder | None,
) -> tuple[RestoredPage, tuple[Finding, ...]]:
    """Restore one sheet, mirrored and turned as the options ask for."""
    restored = sheet.restored or partial(restore, sheet.sheet or sheet.scan, kept=options.kept)
    page = restored(settings, photos=photos, progress=progress, on_step=recorder)
    if not options.allow_distorted:
        check_plausible_page(page.report, len(page.fine.faces))
    if options.to_srgb and options.colours is not None and page.flat.texture is not None:
        page = convert_to_srgb(page, options.colours)
    page = mirror_page(page) if options.mirror else page
    return turned(page, options.rotate, language=options.language)
