"""Reads a session's folder, and completes an interrupted event.

A writer ends one event before it begins the next, so at most the last event is unfinished: its folder is in the payload
and log, manifest or tag manifest do not have it, or have part of it. Anything else is damage, which opening a session
never repairs: `planish verify` reports it, `planish repair` repairs it.
"""

from __future__ import annotations

import errno
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from restore import BadInput
from restore.files import read_regular
from station.errors import DISK, StationError
from station.session.log import bag
from station.session.log.events import FOLDER, MAX_RECORD_BYTES, RECORD, Event, EventDamaged, decode
from station.storage.disk import sync_folder, write_file
from station.storage.folder_lock import WORK
from station.storage.session_folder import FIRST

MAX_EVENTS = 200_000  # twenty for each of the pages that a session has at most: ten seconds and 1 GB to open
MAX_TAG_FILE_BYTES = 2**28  # 1.3 KB for each of them
NO_TAG_FILE = (
    errno.EFBIG,
    errno.EINVAL,
    errno.EISDIR,
    errno.ELOOP,
    errno.ENOTDIR,
)  # of a file that is too large, or of another kind
PADDING = b"\0"  # which some file systems leave at the end of a file that grew before a power cut
VERIFY = "planish verify names what is damaged, planish repair repairs what can be repaired"


class SessionDamaged(StationError):
    """Raised when files of a session contradict each other; nothing was changed."""

    exit_code = DISK


@dataclass(frozen=True)
class Stored:
    """Events of a session, and its tag files.

    As they are on the disk, but for the tag manifest.
    """

    events: tuple[Event, ...]
    files: dict[str, bytes]


def read_stored(folder: Path) -> Stored:
    """Read the log, and the record of an event that is not in it yet.

    Writes nothing. Raises BadInput when the folder is not a session, SessionDamaged, OSError.
    """
    if not (folder / bag.BAGIT).is_file() or not (folder / bag.PAYLOAD).is_dir():
        raise BadInput(f"{folder} is not a session", "make one with planish session new, or check the path")
    files = {name: _read(folder, name) for name in (*bag.FIXED, *bag.GROWING)}
    whole = _whole_lines(files[bag.LOG])
    if (count := whole.count(b"\n")) > MAX_EVENTS:
        raise _damaged(folder, f"{bag.LOG} has {count} events, and no session more than {MAX_EVENTS}")
    try:
        events = [decode(line) for line in whole.splitlines(keepends=True)]
    except EventDamaged as error:
        raise _damaged(folder, f"{bag.LOG}: {error}") from error
    events += _unlogged(folder, events)
    if not events:
        raise _damaged(folder, f"{bag.LOG} is empty")
    return Stored(tuple(events), files)


def identifier_of(folder: Path) -> str | None:
    """Return the identifier of the session in a folder.

    By its first record alone; None where that cannot be read.
    """
    try:
        first = decode(read_regular(folder / FIRST / RECORD, MAX_RECORD_BYTES))
        return str(first.facts["id"])
    except (OSError, EventDamaged, KeyError):
        return None


def complete_tag_files(folder: Path) -> Stored:
    """Read a locked session, and complete the tag files.

    This process has locked it; its last event may be incomplete. Raises SessionDamaged when the content is neither the
    state before nor after it, OSError.
    """
    stored = read_stored(folder)
    before, after = stored.events[:-1], stored.events
    expected = bag.growing_files(after)
    digests = {name: bag.sha512(data) for name, data in {**stored.files, **expected}.items()}
    tag_manifest = _read(folder, bag.TAG_MANIFEST)
    if tag_manifest == bag.tag_manifest(digests) and all(stored.files[n] == expected[n] for n in bag.GROWING):
        return stored
    _check_interrupted(folder, stored, before, tag_manifest)
    return _rewrite(folder, stored, expected, bag.tag_manifest(digests))


def complete_is_possible(folder: Path) -> bool:
    """Return whether the tag files are those of an interrupted writer.

    It was interrupted in its last event. Writes nothing.
    """
    try:
        stored = read_stored(folder)
        _check_interrupted(folder, stored, stored.events[:-1], _read(folder, bag.TAG_MANIFEST))
    except (SessionDamaged, BadInput):
        return False
    return True


def _check_interrupted(folder: Path, stored: Stored, before: Sequence[Event], tag_manifest: bytes) -> None:
    """Raise SessionDamaged unless a writer was interrupted in its last event or tag files."""
    older = bag.growing_files(before)
    digests = {name: bag.sha512(data) for name, data in {**stored.files, **older}.items()}
    if not before or tag_manifest != bag.tag_manifest(digests):
        raise _damaged(folder, f"{bag.TAG_MANIFEST} agrees with no state of the session")
    newer = bag.growing_files(stored.events)
    for name in bag.GROWING:
        data = stored.files[name].rstrip(PADDING)
        if not (data.startswith(older[name]) and newer[name].startswith(data)):
            raise _damaged(folder, f"{name} agrees with no state of the session")
    for path, digest in _last_files(folder, stored.events[-1]):
        if not path.is_file() or bag.sha512(path.read_bytes()) != digest:
            raise _damaged(folder, f"{path} is not the file that was written")


def _last_files(folder: Path, event: Event) -> list[tuple[Path, str]]:
    inside = folder / bag.PAYLOAD / event.folder
    return [(inside / RECORD, event.sha512), *((inside / name, digest) for name, digest in event.files.items())]


def _rewrite(folder: Path, stored: Stored, expected: dict[str, bytes], tag_manifest: bytes) -> Stored:
    work = folder / WORK / "new"
    work.mkdir(exist_ok=True)
    for name, data in {**expected, bag.TAG_MANIFEST: tag_manifest}.items():
        write_file(work / name, data)
        (work / name).replace(folder / name)
        sync_folder(folder)
    return Stored(stored.events, {**stored.files, **expected})


def _whole_lines(log: bytes) -> bytes:
    """Return the log without a line that is not whole.

    Its event is read from its own folder, if that exists.
    """
    return log[: log.rfind(b"\n") + 1]


def _unlogged(folder: Path, events: Sequence[Event]) -> list[Event]:
    """Return the events with a folder in the payload and no line in the log.

    One, or several of a live writer.
    """
    last = len(events)
    names = (match for path in (folder / bag.PAYLOAD).iterdir() if (match := FOLDER.fullmatch(path.name)))
    new = sorted((int(match["number"]), match[0]) for match in names if int(match["number"]) > last)
    try:
        return [decode(read_regular(folder / bag.PAYLOAD / name / RECORD, MAX_RECORD_BYTES)) for _, name in new]
    except (EventDamaged, OSError) as error:
        raise _damaged(folder, f"the record of {new[0][1]} cannot be read: {error}") from error


def _read(folder: Path, name: str) -> bytes:
    try:
        return read_regular(folder / name, MAX_TAG_FILE_BYTES)
    except FileNotFoundError as error:
        raise _damaged(folder, f"{name} is missing") from error
    except OSError as error:
        if error.errno in NO_TAG_FILE:
            raise _damaged(folder, f"{name}: {error.strerror}") from error
        raise


def _damaged(folder: Path, reason: str) -> SessionDamaged:
    return SessionDamaged(f"{folder} is damaged: {reason}", VERIFY)
