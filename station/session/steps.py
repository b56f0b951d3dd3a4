"""The steps that a session records: a scan, a stage's run, a decision, undo and redo."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from restore import BadInput, RangeScan, save_scan
from station.session.events import VOLUME, Event, slot_of
from station.session.history import CAPTURE, earlier, later, redo_target, undo_target
from station.session.store import Session, Writer, file_digest
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


def record_run(
    writer: Writer,
    stage: str,
    on: Event,
    *,
    parameters: Mapping[str, Any],
    result: Mapping[str, Any],
    files: Path | None = None,
    facts: Mapping[str, Any] | None = None,
    others: Sequence[Event] = (),
) -> Event:
    """Record a stage's run on the result of another event, and return its event.

    parameters  all that the run depends on in addition to its input; `reproduce` uses them.
    result      JSON values that follow from input and parameters: `reproduce` must find the same.
    files       a folder of `staging` with the run's files, which `reproduce` must write again to the byte.
    facts       what does not follow from them: seconds, memory.
    others      further events that it read.
    """
    recorded = {"parameters": dict(parameters), "result": dict(result), **(facts or {})}
    return writer.record("stage", slot_of(stage, on), page=on.page, facts=recorded, inputs=[on, *others], files=files)


def decide(writer: Writer, name: str, value: object, *, page: int = VOLUME, on: Event | None = None) -> Event:
    """Record a decision on a page, or `on` its scan; return its event.

    It has a name and a JSON value.
    """
    return writer.record("decision", slot_of(name, on), page=page, facts={"value": value})


def move(writer: Writer, page: int, slot: str, to: Event | None, *, reason: str) -> Event:
    """Let a slot of a page name another of its events, or none.

    Returns the event of that.
    """
    facts = {"to": None if to is None else to.number, "reason": reason}
    return writer.record("move", slot, page=page, facts=facts)


def undo(writer: Writer) -> Event | None:
    """Take back the operator's last step.

    Returns that step, None without one.
    """
    step = undo_target(writer.history)
    if step is not None:
        before = None if step.parent is None else writer.history.event(step.parent)
        move(writer, step.page, step.slot, before, reason="undo")
    return step


def redo(writer: Writer) -> Event | None:
    """Bring back the step that was taken back last.

    Returns it, None without one.
    """
    step = redo_target(writer.history)
    if step is not None:
        move(writer, step.page, step.slot, step, reason="redo")
    return step


def scan_path(session: Session, capture: Event) -> Path:
    """The path of a capture's scan, for `load_scan`."""
    return session.path(capture, str(capture.facts["scan"]))


def undo_run(writer: Writer, page: int, stage: str) -> Event | None:
    """Let a page's stage name the run before its current one, or none.

    Returns the run that was current, if any.
    """
    run = writer.history.page(page).runs.get(stage)
    if run is not None:
        move(writer, page, run.slot, earlier(writer.history, page, run.slot), reason="stage")
    return run


def redo_run(writer: Writer, page: int, stage: str) -> Event | None:
    """Let a page's stage name the run after its current one.

    Returns that run, None without one.
    """
    shown = writer.history.page(page)
    for on in (shown.capture, *shown.runs.values()):
        run = None if on is None else later(writer.history, page, slot_of(stage, on))
        if run is not None:
            move(writer, page, run.slot, run, reason="stage")
            return run
    return None


def _capture(writer: Writer, folder: Path, page: int | None, facts: Mapping[str, Any]) -> Event:
    number = writer.history.free_page() if page is None else page
    return writer.record("capture", CAPTURE, page=number, facts=facts, files=folder)


def _empty(folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder
