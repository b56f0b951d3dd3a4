"""Folders that cannot be watched."""

from __future__ import annotations

import shlex
from pathlib import Path

from station.errors import UsageError
from station.storage.session_folder import session_around


def batch_instead(session: Path) -> str:
    """Return what to report of a session among scans."""
    return f"a session; its pages are restored with: {shlex.join(['planish', 'batch', str(session), '-o', 'OUT'])}"


def check_folders(folder: Path, out: Path) -> None:
    """Raise UsageError for unusable folders of a watch.

    The watched folder must exist, and be neither in a session nor at or in the results.
    """
    if not folder.is_dir():
        raise UsageError(
            f"{folder} is not a folder", "name a folder of scans; planish session list shows where sessions are"
        )
    if session := session_around(folder):
        raise UsageError(f"{folder} is not a folder of scans", f"{session} is {batch_instead(session)}")
    if folder == out or folder.is_relative_to(out):
        raise UsageError(f"the results in {out} would be scans in {folder}", "choose another folder with -o")
