"""The index of all sessions: an SQLite database.

It holds nothing but what the folders say. WAL, so that a list is read while a session is written to; synchronous FULL,
so that a power cut takes no entry back.
"""

from __future__ import annotations

import os
import shlex
import sqlite3
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import astuple, dataclass, fields
from pathlib import Path

from restore import BadInput
from station.errors import DISK, StationError
from station.session.log.history import CapturedPage
from station.session.log.reading import SessionDamaged, identifier_of
from station.session.log.store import Session, read_session
from station.storage.disk import sync_folder
from station.storage.session_folder import is_session

SCHEMA = """
create table if not exists sessions (
    id text primary key, folder text not null, project text not null, title text not null, preset text not null,
    created text not null, changed text not null, events integer not null, pages integer not null
) strict, without rowid;
create table if not exists pages (
    session text not null, page integer not null, position integer not null, label text not null,
    state text not null, level text not null, note text not null, captured text not null,
    primary key (session, page)
) strict, without rowid;
"""
MAGIC = b"SQLite format 3\0"
WAIT_S = 10.0  # for another process that writes to the index: entries are written in milliseconds
INDEX = "sessions.sqlite"


class IndexUnusable(StationError):
    """The database of the index cannot be used.

    The sessions themselves do not need it.
    """

    exit_code = DISK


@dataclass(frozen=True)
class Entry:
    """A session in the index. changed: time of its last event; pages: that have a scan."""

    id: str
    folder: str
    project: str
    title: str
    preset: str
    created: str
    changed: str
    events: int
    pages: int


@dataclass(frozen=True)
class PageEntry:
    """A page in the index.

    position  in the volume, from 1. state: `new`, `restored`, `accepted` or `again`. level: of its verdict, or empty.
    """

    session: str
    page: int
    position: int
    label: str
    state: str
    level: str
    note: str
    captured: str


def default_index(environment: Mapping[str, str]) -> Path:
    """The place of the index of a user: `planish/sessions.sqlite` in XDG_DATA_HOME."""
    base = environment.get("XDG_DATA_HOME") or Path(environment.get("HOME") or "/") / ".local" / "share"
    return Path(base) / "planish" / INDEX


def entries_of(session: Session) -> tuple[Entry, list[PageEntry]]:
    """The entries of a session and of its pages."""
    events, volume = session.history.events, session.volume
    pages = list(session.history.pages())
    folder = os.path.realpath(session.folder)
    entry = Entry(
        session.identifier,
        folder,
        volume.project,
        volume.title,
        volume.preset,
        events[0].time,
        events[-1].time,
        len(events),
        len(pages),
    )
    return entry, [_page_entry(session.identifier, page, position) for position, page in enumerate(pages, 1)]


def update(index: Path, session: Session) -> None:
    """Write the entries of one session.

    Raises BadInput for a path that is not UTF-8 and for a file that is not an index, IndexUnusable, OSError.
    """
    with _opened(index) as database:
        _write(database, session)


def reindex(index: Path, folders: Iterable[Path]) -> list[str]:
    """Build the index again from the sessions in these folders and below.

    Without any folder: from those that the index knows. The old index stays until the new one is complete. Returns why
    sessions could not be read. Raises BadInput for a folder that does not exist and for a file that is not an index,
    IndexUnusable, OSError.
    """
    _refuse_others(index)
    given = list(folders)
    for folder in given:
        if not folder.is_dir():
            raise BadInput(f"the folder {folder} does not exist", "check the path: is its disk mounted?")
    starts = given or [Path(entry.folder) for entry in sessions(index)]
    problems: list[str] = []
    index.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{index.name}-", dir=index.parent) as work:
        new = Path(work) / index.name
        with _opened(new) as database:
            for folder in _sessions_below(starts, problems):
                _enter_or_report(database, folder, problems)
        _replace_database(index, new)
    return problems


def sessions(index: Path) -> list[Entry]:
    """Return all sessions of the index, the one changed last first.

    Raises IndexUnusable, BadInput for another file.
    """
    if not index.exists():
        return []
    names = ", ".join(item.name for item in fields(Entry))
    with _opened(index) as database:
        return [Entry(*row) for row in database.execute(f"select {names} from sessions order by changed desc, id")]


def pages(index: Path) -> list[PageEntry]:
    """All pages of the index, by session and position. Raises IndexUnusable."""
    names = ", ".join(item.name for item in fields(PageEntry))
    with _opened(index) as database:
        rows = database.execute(f"select {names} from pages order by session, position")
        return [PageEntry(*row) for row in rows]


def find(index: Path, name: str) -> Path:
    """Return the folder of a session.

    name: a path, or the identifier or title of a session that the index knows.
    Raises BadInput without such a session, or with several, or when it is no longer where the index has it.
    """
    if Path(name).is_dir():
        return Path(name)
    place = os.path.realpath(name)
    known = [entry for entry in sessions(index) if name in (entry.id, entry.title) or place == entry.folder]
    if len(known) == 1:
        return _folder_of(known[0])
    if known:
        raise BadInput(f"{len(known)} sessions are called {name!r}", "give the folder: planish session list names it")
    raise BadInput(
        f"the session {name!r} does not exist",
        "give its folder, or see planish session list; planish reindex FOLDER enters others",
    )


def _folder_of(entry: Entry) -> Path:
    """The folder of an entry. Raises BadInput when it is gone or holds another session."""
    folder = Path(entry.folder)
    if folder.is_dir() and identifier_of(folder) in (entry.id, None):  # None: damaged, and recognised by its file names
        return folder
    gone = f"the session {entry.title!r} is no longer in {folder}"
    siblings = sorted(folder.parent.iterdir()) if folder.parent.is_dir() else []
    for other in siblings:
        if identifier_of(other) == entry.id:
            enter = shlex.join(["planish", "session", "recover", str(other)])
            raise BadInput(gone, f"{other} is that session or a copy of it; {enter} enters it there")
    raise BadInput(gone, "find its folder, or mount its disk; where it was moved, planish reindex FOLDER enters it")


@contextmanager
def _opened(index: Path) -> Iterator[sqlite3.Connection]:
    """The database in a transaction, which ends with the block."""
    _refuse_others(index)
    index.parent.mkdir(parents=True, exist_ok=True)
    try:
        with closing(sqlite3.connect(index, timeout=WAIT_S, isolation_level=None)) as database:
            database.execute("pragma journal_mode = wal")
            database.execute("pragma synchronous = full")
            database.executescript(SCHEMA)
            database.execute("begin immediate")
            yield database
            database.execute("commit")
    except sqlite3.Error as error:
        hint = "the sessions are whole without it: rebuild it with planish reindex FOLDER"
        raise IndexUnusable(f"the index {index} cannot be used: {error}", hint) from error


def _refuse_others(index: Path) -> None:
    """Raise BadInput for an existing file that is not an index.

    It is neither replaced nor added to. A damaged index is known by its name, or by what it still has of a database.
    """
    if not index.is_file() or not index.stat().st_size:
        return
    with index.open("rb") as file:
        is_database = file.read(len(MAGIC)) == MAGIC
    tables = _tables(index) if is_database else set()
    if (not is_database and index.name != INDEX) or (tables and "sessions" not in tables):
        raise BadInput(f"{index} is not an index of sessions", "name another file with --index")


def _tables(index: Path) -> set[str]:
    """The names in a database, which is only read; none when it is damaged."""
    try:
        with closing(sqlite3.connect(f"{index.absolute().as_uri()}?mode=ro", uri=True)) as database:
            return {name for (name,) in database.execute("select name from sqlite_master")}
    except sqlite3.Error:
        return set()


def _write(database: sqlite3.Connection, session: Session) -> None:
    entry, own = entries_of(session)
    try:
        entry.folder.encode()
    except UnicodeEncodeError as error:  # of a name in another encoding, as older systems wrote them
        message = f"the path {entry.folder!r} is not UTF-8, which the index does not hold"
        raise BadInput(message, "rename the folder") from error
    database.execute("delete from pages where session = ?", (entry.id,))
    database.execute(f"insert or replace into sessions values ({_marks(Entry)})", astuple(entry))
    database.executemany(f"insert into pages values ({_marks(PageEntry)})", [astuple(page) for page in own])


def _enter_or_report(database: sqlite3.Connection, folder: Path, problems: list[str]) -> None:
    """Write the entries of a folder's session, or add to `problems` why not."""
    try:
        _write(database, read_session(folder))
    except (BadInput, SessionDamaged) as error:
        problems.append(str(error))
    except OSError as error:
        problems.append(_unreadable(error, folder))


def _unreadable(error: OSError, path: Path | None = None) -> str:
    if isinstance(error, FileNotFoundError):
        return f"{path or error.filename} is gone: where it was moved, planish reindex FOLDER enters it"
    return f"{path or error.filename} cannot be read: {error.strerror}"


def _replace_database(index: Path, new: Path) -> None:
    for suffix in ("-wal", "-shm"):  # a log of the old database would be replayed into the new one
        index.with_name(index.name + suffix).unlink(missing_ok=True)
    new.replace(index)
    sync_folder(index.parent)


def _marks(table: type) -> str:
    return ", ".join("?" * len(fields(table)))


def _page_entry(session: str, page: CapturedPage, position: int) -> PageEntry:
    label, note, time = page.decided.label or "", page.decided.note, page.capture.time
    return PageEntry(session, page.number, position, label, page.state, page.level, note, time)


def _sessions_below(folders: Iterable[Path], problems: list[str]) -> Iterator[Path]:
    """Yield every folder with a log of events, at or below these, None within a session.

    problems: of unreadable folders.
    """
    for start in folders:
        for base, inner, _ in os.walk(start, onerror=lambda error: problems.append(_unreadable(error))):
            if is_session(Path(base)):
                inner.clear()
                yield Path(base)
