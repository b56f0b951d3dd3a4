"""Scans by others and shots of the scanner: the files that make up one scan.

Under the names by which they refer to each other.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from drivers.scanner import ScanFile, Shot
from restore import BadInput, load_scan
from restore.formats import COMMON_READERS, SCAN_SUFFIXES
from station.intake.companions import Pairing, is_scan
from station.intake.listing import list_files
from station.session.captures.scans import CAPTURING, Staged, add_scan, record_staged, stage_files
from station.session.log.events import Event
from station.session.log.store import Writer

CAPTURED = "planish capture"


@dataclass(frozen=True)
class Gathered:
    """The files of one scan.

    source  the scan's name among them. files: name, relative to the scan → where it is.
    """

    source: str
    files: Mapping[str, Path]


def gather(path: Path) -> Gathered:
    """Return the files of a scan, with those it names and the picture of its name.

    Raises BadInput for what is missing or is not a scan, OSError when the folder cannot be read.
    """
    if not path.exists():
        raise BadInput(f"{path} does not exist", "check the name and the folder")
    path = path.absolute()
    if path.is_dir():
        name = path.resolve().name
        inside = sorted(file for file in path.rglob("*") if file.is_file())
        return Gathered(name, {f"{name}/{file.relative_to(path).as_posix()}": file for file in inside})
    source = Path(path.name)
    listing = list_files(path.parent, without=path.parent)
    if not (is_scan(source) or source.suffix.lower() in COMMON_READERS) or source not in listing:
        raise BadInput(
            f"{path} is not a scan file that is known", f"give a scan folder, or one of {', '.join(SCAN_SUFFIXES)}"
        )
    pairing = Pairing(path.parent)
    pairing.update(listing)
    found = pairing.companions(source).found
    return Gathered(path.name, {path.name: path, **{name: path.parent / place for name, place in found.items()}})


def add_originals(writer: Writer, paths: Sequence[Path], **reading: str) -> list[Event]:
    """Store scans of others as new pages, all of them or none.

    Returns their events. Raises as `add_original`.
    """
    copies = [f"{CAPTURING}-{number}" for number in range(len(paths))]
    try:
        staged = [_stage(writer, path, reading, copy) for path, copy in zip(paths, copies, strict=True)]
        return [record_staged(writer, one) for one in staged]
    finally:
        for copy in copies:
            shutil.rmtree(writer.staging(copy), ignore_errors=True)


def add_original(writer: Writer, path: Path, *, page: int | None = None, **reading: str) -> Event:
    """Store a scan of others as a page, unchanged; return its event, with where it came from.

    reading: unit, grid and depth as for `load_scan`; kept for the restoration.
    Raises BadInput for what cannot be read as a scan, OSError.
    """
    return record_staged(writer, _stage(writer, path, reading, CAPTURING), page=page)


def add_shot(writer: Writer, shot: Shot, *, page: int | None = None) -> Event:
    """Store a shot of the scanner as a page's current scan; return its event.

    A file is stored as it came.
    page: None for a new page.
    Raises BadInput for a file that cannot be read as a scan; it is kept, and the error names its place. Raises OSError.
    """
    if not isinstance(shot, ScanFile):
        return add_scan(writer, shot, page=page, facts={"by": CAPTURED, "provenance": dict(shot.provenance)})
    try:
        staged = _stage(writer, shot.path, shot.reading, CAPTURING, by=CAPTURED, known=shot.provenance)
        event = record_staged(writer, staged, page=page)
    except BadInput as error:
        raise BadInput(str(error), f"{error.hint}; the file is kept: {shot.path}") from error
    except OSError as error:
        error.add_note(f"the shot is kept: {shot.path}")
        raise
    shot.discard()
    return event


def _stage(
    writer: Writer,
    path: Path,
    reading: Mapping[str, str],
    name: str,
    *,
    by: str = "session add",
    known: Mapping[str, Any] = MappingProxyType({}),
) -> Staged:
    """A copy of a scan of others that can be read. Raises as `add_original`.

    by, known: what is recorded of it: how it came, and further provenance.
    """
    gathered = gather(path)
    facts = {
        "by": by,
        "from": os.fsencode(path.absolute()).decode(errors="backslashreplace"),
        "unit": "auto",
        **{name: value for name, value in reading.items() if value != "auto"},
        "modified": {name: file.stat().st_mtime_ns for name, file in gathered.files.items()},
    }

    def provenance(copy: Path) -> dict[str, Any]:
        try:
            return {"provenance": {**load_scan(copy, **reading).provenance, **known}}
        except BadInput as error:
            cause = error.__cause__
            if isinstance(cause, OSError):  # of the copy, which was written just now: the disk's fault
                raise OSError(cause.errno, cause.strerror, str(copy)) from error
            # The copy is not the operator's concern.
            message = str(error).replace(str(copy), str(path)).replace(str(copy.parent), str(path.parent))
            raise BadInput(message, error.hint) from error

    return stage_files(writer, gathered.files, gathered.source, facts=facts, inspect=provenance, name=name)
