"""Where results and failures of a watched folder are stored.

They are the watch's memory. A result is `OUT/<sub-folder>/<stem>/`, whose report names the scan and the digest of its
files. A failure is `OUT/failed/<sub-folder>/<file>.txt`. What has neither is still to be done, also after a power cut.
"""

from __future__ import annotations

import glob
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from itertools import chain, count
from pathlib import Path
from typing import Any

from restore.files import read_regular
from station.intake.arrival import Arrival, shortened
from station.storage.disk import sync_folder, write_file

FAILED, NOTE, ATTEMPT = "failed", ".txt", ".attempt"
MAX_BYTES = 2**24  # of a report or a note
MAX_TRIES = 100  # to write into a folder that others remove: each needs one of them to come between two system calls
DIGEST = "sha256: "
AGAIN = "it is tried again when it changes, or at the next start without this file; planish restore has all options"


def reports_of(folder: Path, arrival: Arrival) -> list[Path]:
    """Return the reports of the arrival's results in a folder.

    One, or one for each of several sheets of a scan.
    """
    report = folder / f"{arrival.stem}.json"
    return [report] if report.exists() else sorted(folder.glob(f"{glob.escape(arrival.stem)}-[0-9]*.json"))


def result_folders(out: Path, arrival: Arrival) -> Iterator[Path]:
    """Yield the folders that its results may be in, without end.

    Scans of the same name, and later versions, are counted.
    """
    base = _folder(out, arrival.source.parent)
    for number in count(1):
        yield base / (arrival.stem if number == 1 else f"{arrival.stem}-{number}")


def find_result(out: Path, arrival: Arrival, digest: str | None = None) -> Path | None:
    """Return the folder with the results of this very arrival, or None.

    digest: None compares the stamps.
    """
    for folder in result_folders(out, arrival):
        if _is_free(folder, arrival.stem):
            return None
        known = next(map(_arrival_in, reports_of(folder, arrival)), {})
        if known.get("scan", known.get("source")) != str(arrival.source):
            continue
        if known.get("sha256") == digest or known.get("files") == arrival.as_data("")["files"]:
            return folder
    raise AssertionError  # result_folders never ends


def free_folder(out: Path, arrival: Arrival) -> Path:
    """The first folder for results that has no files yet."""
    return next(folder for folder in result_folders(out, arrival) if _is_free(folder, arrival.stem))


def note_of(out: Path, arrival: Arrival) -> Path:
    """The note of a failure of the arrival."""
    return _record(out, arrival, NOTE)


def failed_digest(out: Path, arrival: Arrival) -> str | None:
    """Return the digest of the version that was quarantined last, or None."""
    with suppress(OSError, ValueError):
        for line in read_regular(note_of(out, arrival), MAX_BYTES).decode("utf-8", "replace").splitlines():
            if line.startswith(DIGEST):
                return line.removeprefix(DIGEST)
    return None


def set_aside(out: Path, arrival: Arrival, digest: str, reasons: Sequence[str], now: datetime) -> Path:
    """Write the note of a failure: the reasons, then what it is about.

    Returns its path. Raises OSError.
    """
    facts = {"scan": arrival.folder / arrival.source, "time": now.isoformat(timespec="seconds")}
    lines = [*reasons, AGAIN, "", *(f"{name}: {value}" for name, value in facts.items()), DIGEST + digest]
    path = note_of(out, arrival)
    text = "\n".join(lines) + "\n"
    _put(path, text.encode("utf-8", "backslashreplace"))
    return path


def forget_failure(out: Path, arrival: Arrival) -> None:
    """Remove the note of a failure for a scan that could be restored in the end.

    Raises OSError.
    """
    note = note_of(out, arrival)
    note.unlink(missing_ok=True)
    remove_empty(note.parent, out)


def remove_empty(folder: Path, end: Path) -> None:
    """Remove a folder, and those above it up to `end`, as long as they are empty."""
    with suppress(OSError):
        while folder != end:
            folder.rmdir()
            folder = folder.parent


def begin_attempt(out: Path, arrival: Arrival, digest: str) -> int:
    """Record that the restoration begins.

    Returns how many earlier ones of this version were cut off.
    """
    path = _attempt_of(out, arrival)
    known, times = "", "0"
    with suppress(OSError, ValueError):
        known, times = read_regular(path, MAX_BYTES).decode().split()
    before = int(times) if known == digest and times.isdigit() else 0
    _put(path, f"{digest} {before + 1}\n".encode())
    return before


def end_attempt(out: Path, arrival: Arrival) -> None:
    """Take note that it has ended, well or not. Raises OSError."""
    path = _attempt_of(out, arrival)
    path.unlink(missing_ok=True)
    remove_empty(path.parent, out)


def utc() -> datetime:
    """The present time."""
    return datetime.now(UTC)


def _put(path: Path, data: bytes) -> None:
    """Write a record in one step.

    Other processes may write others to the same folder, and remove it when it is empty. Each scan has its own records,
    which one process writes at a time.
    """
    part = path.with_name(f".{path.name}.part")
    for attempt in range(MAX_TRIES):
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_file(part, data)
            part.replace(path)
            sync_folder(path.parent)
            return
        except (FileNotFoundError, FileExistsError):  # another process has removed the empty folder meanwhile
            if attempt == MAX_TRIES - 1:
                raise


def _attempt_of(out: Path, arrival: Arrival) -> Path:
    return _record(out, arrival, ATTEMPT)


def _record(out: Path, arrival: Arrival, ending: str) -> Path:
    """A record of the arrival; where a folder has its name, the first that is free."""
    folder = _folder(out / FAILED, arrival.source.parent)
    names = _counted(shortened(arrival.source.name))
    return next(path for name in names if not (path := folder / (name + ending)).is_dir())


def _folder(base: Path, sub: Path) -> Path:
    """Return the folder of a sub-folder's results.

    Where a file has the name of one, as a page may, the first that is free.
    """
    here = base
    for part in sub.parts:
        here = next(path for name in _counted(part) if not _is_file(path := here / name))
    return here


def _counted(name: str) -> Iterator[str]:
    return chain([name], (f"{name}-{number}" for number in count(2)))


def _is_file(path: Path) -> bool:
    return os.path.lexists(path) and not path.is_dir()


def _is_free(folder: Path, stem: str) -> bool:
    """Return whether a folder holds nothing but those of sub-folders.

    None of them is in the way of a result.
    """
    try:
        return not any(
            entry.is_file() or entry.is_symlink() or entry.name.startswith((f"{stem}.", f"{stem}-"))
            for entry in folder.iterdir()
        )
    except FileNotFoundError:
        return True
    except NotADirectoryError:
        return False


def _arrival_in(report: Path) -> Mapping[str, Any]:
    try:
        arrival = json.loads(read_regular(report, MAX_BYTES))["arrival"]
        return arrival if isinstance(arrival, dict) else {}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return {}
