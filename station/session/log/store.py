"""The folder of a session.

Created in one step, read without a lock, written by one process at a time. docs/decisions/session-folder.md describes
the layout and why an event is whole or absent after any interruption.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from uuid import uuid4

from restore import BadInput
from station.errors import StationError
from station.session.log import bag
from station.session.log.checks import check_facts
from station.session.log.events import RECORD, VOLUME, Event, Input, Kind, encode
from station.session.log.history import History, extended, folded
from station.session.log.reading import MAX_EVENTS, SessionDamaged, Stored, complete_tag_files, read_stored
from station.session.terms.texts import check_text
from station.session.terms.volume import Volume, volume_of_facts
from station.storage.atomic import lock_output_folder, new_folder
from station.storage.disk import add_path_to_errors, sync_folder, sync_tree, write_and_sync, write_file
from station.storage.folder_lock import FolderLock, lock_folder
from station.storage.session_folder import refuse_reserved
from station.version import software_version

Now = Callable[[], datetime]

READ_ONLY = 0o444
STAGED = "event"
TAKEN = "choose another name"
FOREIGN = "take it from a copy, or have it repaired by who changed it: planish verify shows which files differ"


def utc() -> datetime:
    """The present time."""
    return datetime.now(UTC)


class SessionBroken(StationError):
    """A session is written to after the disk has refused.

    Opening it again completes or drops the event.
    """


@dataclass(frozen=True)
class Session:
    """A session as it was read.

    folder   the bag.
    history  its events and pointers.
    """

    folder: Path
    history: History

    @property
    def volume(self) -> Volume:
        """What the session is of, from its first event."""
        return volume_of_facts(self.history.event(1).facts)

    @property
    def identifier(self) -> str:
        """The identifier of the session, the same on every disk."""
        return str(self.history.event(1).facts["id"])

    def path(self, event: Event, name: str = "") -> Path:
        """The folder of an event, or a file in it."""
        return self.folder / bag.PAYLOAD / event.folder / name


def create_session(
    folder: Path, volume: Volume, *, now: Now = utc, new_id: Callable[[], str] = lambda: str(uuid4())
) -> None:
    """Create a session: a bag that holds one event. It is there whole, or not at all.

    Raises UsageError for a reserved name and for control characters in a text, OverwriteError when something of that
    name is there, FolderInUse, OSError when the disk refuses.
    """
    folder = Path(os.path.abspath(folder))  # noqa: PTH100 — without following a link at its end
    refuse_reserved(folder)
    for name in ("title", "project", "organisation"):
        check_text(name, getattr(volume, name))
    facts = {"id": new_id(), **volume.facts()}
    time = _stamp(now())
    first = Event(1, VOLUME, "session", "session", None, time, software_version(), facts)
    files = bag.tag_files([first])
    with lock_output_folder(folder.parent) as lock, new_folder(lock, folder.name, hint=TAKEN) as staged:
        (staged / bag.PAYLOAD / first.folder).mkdir(parents=True)
        for name, data in files.items():
            (staged / name).write_bytes(data)
        (staged / bag.PAYLOAD / first.folder / RECORD).write_bytes(first.line)
        _seal(staged / bag.PAYLOAD)


def read_session(folder: Path) -> Session:
    """Read a session without locking it.

    Another process may be writing to it. Raises BadInput when the folder is not a session, SessionDamaged, OSError.
    """
    return Session(folder, checked_history(folder, read_stored(folder).events))


def checked_history(folder: Path, events: Sequence[Event]) -> History:
    """Return the history of the events of a session, with checked facts.

    They can be shown and checked. Raises SessionDamaged.
    """
    try:
        history = folded(events)
        check_facts(history)
    except ValueError as error:
        raise SessionDamaged(f"{folder} is damaged: {error}", FOREIGN) from error
    return history


@contextmanager
def open_session(folder: Path, *, now: Now = utc) -> Iterator[Writer]:
    """Open a session for writing.

    The one writer has its folder until the block ends. An event that an earlier writer did not finish is completed if
    it is whole, dropped if it is not. Raises BadInput when the folder is not a session, FolderInUse that names the
    other writer, SessionDamaged, OSError.
    """
    checked_history(folder, read_stored(folder).events)  # before anything is completed
    with lock_folder(folder) as lock:
        stored = complete_tag_files(folder)
        yield Writer(lock, stored, now)


class Writer:
    """The one writer of a session. Its methods may be called from several threads."""

    def __init__(self, lock: FolderLock, stored: Stored, now: Now) -> None:
        self._folder_lock, self._now = lock, now
        self._lock = threading.Lock()
        self._broken = False
        self._digests = {name: hashlib.sha512(data) for name, data in stored.files.items()}
        self._sizes = {name: len(stored.files[name]) for name in bag.GROWING}
        self.session = Session(lock.folder, folded(stored.events))
        self._identity = identity_of(lock.folder)

    @property
    def history(self) -> History:
        """The events so far."""
        return self.session.history

    def staging(self, name: str) -> Path:
        """Return the path of a folder for files of an event to come.

        On the same disk; an interrupted run's is removed. The caller makes the folder and fills it.
        name: one for each piece of work under way.
        """
        self._folder_lock.new.mkdir(exist_ok=True)
        return self._folder_lock.new / name

    def record(
        self,
        kind: Kind,
        slot: str,
        *,
        page: int = VOLUME,
        facts: Mapping[str, Any] | None = None,
        inputs: Sequence[Event] = (),
        files: Path | None = None,
    ) -> Event:
        """Write one event and return it; it is on the disk by then.

        files  a folder of `staging` with the event's files: it is moved into the session.
        Raises BadInput for a file's name that no manifest holds, OSError when the disk refuses, then SessionBroken.
        """
        with self._lock:
            self._check_usable()
            staged = files or self._empty_folder()
            (staged / RECORD).unlink(missing_ok=True)  # of an attempt that the disk refused
            now = self.history.current(page, slot)
            event = Event(
                number=len(self.history.events) + 1,
                page=page,
                kind=kind,
                slot=slot,
                parent=None if now is None else now.number,
                time=_stamp(self._now()),
                software=software_version(),
                facts=facts or {},
                inputs=tuple(Input(one.number, one.sha512) for one in inputs),
                files=file_digests(staged),
            )
            history = extended(self.history, event)
            write_file(staged / RECORD, _line_of(event))
            _seal(staged)
            sync_tree(staged)
            self._broken = True
            self._put(event, staged)
            self._broken = False
            self.session = Session(self.session.folder, history)
            return event

    def _empty_folder(self) -> Path:
        folder = self.staging(STAGED)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        return folder

    def _check_usable(self) -> None:
        if self._broken:
            raise SessionBroken(
                f"{self.session.folder} was not written to the end: the disk refused",
                "repair the disk, then run the same command again: what was stored is there",
            )
        if identity_of(self.session.folder) != self._identity:
            raise SessionBroken(
                f"{self.session.folder} is no longer the folder that was opened", "put it back, then open it again"
            )
        if len(self.history.events) >= MAX_EVENTS:
            raise StationError(f"{self.session.folder} holds as many events as it can", "begin another session")

    def _put(self, event: Event, staged: Path) -> None:
        """Move an event's folder into the payload, then extend and flush log and manifests."""
        folder = self.session.folder
        payload = folder / bag.PAYLOAD
        staged.rename(payload / event.folder)
        sync_folder(payload)
        for name, data in bag.growing_files([event]).items():
            append(folder / name, data, self._sizes[name])
            self._sizes[name] += len(data)
            self._digests[name].update(data)
        digests = {name: digest.hexdigest() for name, digest in self._digests.items()}
        replace_file(folder / bag.TAG_MANIFEST, self._folder_lock.new, bag.tag_manifest(digests))


def identity_of(folder: Path) -> tuple[int, int] | None:
    """Return what the system knows a folder by, whatever its name, None without the folder."""
    try:
        state = folder.stat()
    except OSError:
        return None
    return state.st_dev, state.st_ino


def _line_of(event: Event) -> bytes:
    """Return the record of an event.

    Raises BadInput for a text that is not UTF-8, as of a terminal in another encoding.
    """
    try:
        return encode(event)
    except UnicodeEncodeError as error:
        raise BadInput(f"{error.object[error.start : error.end]!r} is not text in UTF-8", "write it again") from error


def file_digests(folder: Path) -> dict[str, str]:
    """Map path to SHA-512 of every file under a folder, in alphabetical order.

    Raises BadInput, OSError.
    """
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    names = [path.relative_to(folder).as_posix() for path in paths]
    for name in names:
        bag.check_name(name)
    return {name: file_digest(path) for name, path in zip(names, paths, strict=True)}


def file_digest(path: Path) -> str:
    """SHA-512 of a file. Raises OSError that names it."""
    with add_path_to_errors(path), path.open("rb") as file:
        return hashlib.file_digest(file, "sha512").hexdigest()


def append(path: Path, data: bytes, size: int) -> None:
    """Append data to a file of a known size, and flush it.

    Raises OSError, StationError when it is of another size.
    """
    with add_path_to_errors(path), path.open("r+b") as file:
        found = file.seek(0, os.SEEK_END)
        if found != size:
            raise StationError(
                f"{path} has {found} bytes, where this run left {size}", "another program changed it: planish verify"
            )
        write_and_sync(file, data)


def replace_file(path: Path, work: Path, data: bytes) -> None:
    """Replace a file in one step, flushed.

    work: a folder on the same disk for the new file.
    """
    work.mkdir(exist_ok=True)
    write_file(work / path.name, data)
    (work / path.name).replace(path)
    sync_folder(path.parent)


def _seal(folder: Path) -> None:
    """Take the right to write from every file under a folder."""
    for path in folder.rglob("*"):
        if path.is_file():
            path.chmod(READ_ONLY)


def _stamp(time: datetime) -> str:
    return time.astimezone(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
