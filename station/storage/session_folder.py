"""The folder of a session, known by its files.

Its content is a record, which its own commands alone add to.
"""

from __future__ import annotations

import os
from pathlib import Path

from station.errors import UsageError

BAGIT, LOG = "bagit.txt", "events.jsonl"
FIRST = "data/0000-000001-session"  # the folder of its first event
EXPORTS, BATCHES = "exports", "batches"  # folders of the web interface, next to its sessions
RESERVED = frozenset({EXPORTS, BATCHES})  # names that no session has: later exports would be written into it
OUTSIDE = "what lies in a session is its record: choose a place outside it"


def is_session(folder: Path) -> bool:
    """Return whether a folder is a session's, also in mid-copy or with its log lost.

    False for one that may not be searched.
    """
    try:
        return (folder / BAGIT).is_file() and ((folder / LOG).is_file() or (folder / FIRST).is_dir())
    except OSError:
        return False


def session_around(path: Path) -> Path | None:
    """Return the folder of the session that a path is or is in, also by a link, or None.

    The path need not exist.
    """
    real = Path(os.path.realpath(path))
    return next((folder for folder in (real, *real.parents) if is_session(folder)), None)


def refuse_reserved(folder: Path) -> None:
    """Raise UsageError for a folder whose name no session may have."""
    if folder.name.casefold() in RESERVED:  # some disks make no difference between upper and lower case
        raise UsageError(f"{folder.name} is the name of a folder for exports and batches", "choose another name")


def refuse_session(path: Path, hint: str = OUTSIDE) -> None:
    """Raise UsageError for a place to write to that is a session or lies in one."""
    session = session_around(path)
    if session is not None:
        is_it = session == Path(os.path.realpath(path))
        raise UsageError(f"{path} is a session" if is_it else f"{path} lies in the session {session}", hint)
