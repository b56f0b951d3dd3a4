"""Store scans as a page's originals, all of a scan or nothing."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from restore import BadInput, RangeScan, save_scan
from station.session.log.events import Event
from station.session.log.history import CAPTURE
from station.session.log.store import Session, Writer, file_digest
from station.storage.disk import copy_file, named_as

ORIGINAL, SCAN = "original", "scan"


CAPTURING = "capturing"


def add_scan(writer: Writer, scan: RangeScan, *, page: int | None = None, facts: Mapping[str, Any]) -> Event:
    """Store a scan of the scanner as a page's current one.

    It is on the disk when its event is returned.
    page: None for a new page.
    facts: further facts of the capture; `scan` is where `load_scan` finds it in the event's folder.
    """
    folder = _empty(writer.staging(CAPTURING))
    save_scan(scan, folder / ORIGINAL / SCAN)
    return _capture(writer, folder, page, {"scan": f"{ORIGINAL}/{SCAN}", **facts})


def add_files(
    writer: Writer,
    files: Mapping[str, Path],
    source: str,
    *,
    page: int | None = None,
    facts: Mapping[str, Any],
    inspect: Callable[[Path], Mapping[str, Any]] = lambda _path: {},
) -> Event:
    """Store a copy of a scan's files as a page's current scan.

    Parameters as of `stage_files`. Returns its event.
    """
    return record_staged(writer, stage_files(writer, files, source, facts=facts, inspect=inspect), page=page)


class Staged(NamedTuple):
    """Copy of a scan's files in a folder of `staging`.

    It is not a page yet, and has the facts of its capture.
    """

    folder: Path
    facts: Mapping[str, Any]


def stage_files(
    writer: Writer,
    files: Mapping[str, Path],
    source: str,
    *,
    facts: Mapping[str, Any],
    inspect: Callable[[Path], Mapping[str, Any]] = lambda _path: {},
    name: str = CAPTURING,
) -> Staged:
    """A copy of a scan's files, which `record_staged` makes a page.

    files   name under `original` → the file to copy.
    source  the name of the scan among them.
    inspect looks at the copy: returns further facts, or raises.
    name    of the copy; two under way at once have different ones.
    Raises BadInput for a file that changes while it is copied, OSError.
    """
    folder = _empty(writer.staging(name))
    for name, path in files.items():
        target = folder / ORIGINAL / name
        with named_as(folder / ORIGINAL, writer.session.folder):
            target.parent.mkdir(parents=True, exist_ok=True)
            copy_file(path, target)
        if file_digest(path) != file_digest(target):
            raise BadInput(f"{path} changed while it was copied", "wait until it is complete, then add it again")
    found = inspect(folder / ORIGINAL / source)
    return Staged(folder, {"scan": f"{ORIGINAL}/{source}", **facts, **found})


def record_staged(writer: Writer, staged: Staged, *, page: int | None = None) -> Event:
    """Make a copy a page's current scan, of a new page for None.

    Returns its event. Raises OSError.
    """
    return _capture(writer, staged.folder, page, staged.facts)


def scan_path(session: Session, capture: Event) -> Path:
    """The path of a capture's scan, for `load_scan`."""
    return session.path(capture, capture.captured.scan)


def _capture(writer: Writer, folder: Path, page: int | None, facts: Mapping[str, Any]) -> Event:
    number = writer.history.free_page() if page is None else page
    return writer.record("capture", CAPTURE, page=number, facts=facts, files=folder)


def _empty(folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder
