"""The tasks of jobs: of which session, and into which new folder."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

from station.console.faults import ConsoleFault
from station.console.state import sessions
from station.storage.session_folder import BATCHES, EXPORTS, refuse_session

Task = tuple[str, dict[str, Any], dict[str, Any]]
"""The kind of a job, what is shown of it, and what its process reads."""


def export_task(root: Path, folder: Path, kind: str, url: str | None) -> Task:
    """Return the task to export the session of a folder.

    root: folder with the sessions.
    Raises UsageError.
    """
    task = {"session": str(folder), "out": _place(root / EXPORTS / f"{folder.name}-{kind}"), "format": kind, "url": url}
    return "export", {"session": folder.name, "format": kind}, task


def batch_task(
    root: Path, held: Path | None, names: list[str], workers: int | None, now: Callable[[], datetime]
) -> Task:
    """Return the task to restore all unrestored pages of sessions.

    held: folder of the session that this process writes to.
    Raises ConsoleFault, UsageError.
    """
    folders = [_closed(root, held, name) for name in dict.fromkeys(names)]
    out = _place(root / BATCHES / now().strftime("%Y-%m-%d-%H%M%S"))
    task = {"sessions": [str(folder) for folder in folders], "out": out, "workers": workers}
    return "batch", {"sessions": [folder.name for folder in folders]}, task


def verify_task(root: Path, held: Path | None, name: str) -> Task:
    """To compare every file of a session with what its events say. Raises ConsoleFault."""
    return "verify", {"session": name}, {"session": str(_closed(root, held, name))}


def _place(out: Path) -> str:
    """Return where a job writes, with a number when something of that name exists."""
    refuse_session(out, "move the session to another name: this one is for exports and batches")
    return str(out)


def _closed(root: Path, held: Path | None, name: str) -> Path:
    """Return the folder of a session that is not open here.

    Another process could not have it.
    """
    folder = sessions.find(root, name)
    if folder == held:
        raise ConsoleFault("session_open", f"{name} is open", "close it first")
    return folder
