"""The state of the station as it is shown."""

from __future__ import annotations

import shutil
from datetime import datetime
from pathlib import Path
from typing import Any

from station.console.state.control import Control
from station.console.state.jobs import Jobs
from station.console.state.open_session import OpenSession
from station.console.state.scanner import ScannerOwner
from station.session.leaves.leaf import missing_labels
from station.session.log.history import redo_target, undo_target
from station.version import software_version

SHOWN_JOBS = 20


def state_of(
    root: Path,
    opened: OpenSession | None,
    scanner: ScannerOwner,
    control: Control,
    jobs: Jobs,
    failed: dict[str, Any] | None,
    now: datetime,
) -> dict[str, Any]:
    """The state of the station as JSON values. Raises OSError.

    root: folder with the sessions. failed: the error that ended the last session.
    """
    usage = shutil.disk_usage(root)
    return {
        "version": software_version(),
        "time": stamp(now),
        "scanner": scanner.as_json(),
        "session": None if opened is None else session_state(opened),
        "recovery": None if opened is None else opened.recovery,
        "disk": {
            "free_bytes": usage.free,
            "total_bytes": usage.total,
            "captures_left": None if opened is None else captures_left(opened, usage.free),
        },
        "control": control.as_json(),
        "jobs": [job.as_json() | {"items": job.items[-1:]} for job in jobs.all()[:SHOWN_JOBS]],
        "failed": failed,
    }


def session_state(opened: OpenSession) -> dict[str, Any]:
    """The open session: what it is of, how far it is, what undo and redo would do."""
    session, rows = opened.session, opened.rows()
    volume, history = session.volume, session.history
    steps = {"undo": undo_target(history), "redo": redo_target(history)}
    numbers = {row["page"] for row in rows}
    return {
        "name": opened.name,
        "id": session.identifier,
        "title": volume.title,
        "project": volume.project,
        "organisation": volume.organisation,
        "preset": volume.preset,
        "folder": str(opened.folder),
        "read_only": opened.is_read_only,
        "held_by": opened.held_by or None,
        "events": len(history.events),
        "pages": len(rows),
        "current": opened.page if opened.page in numbers else None,
        "restoring": opened.restoring,
        "missing": missing_labels(session),
        **{
            name: None if step is None else {"step": step.name, "page": step.page or None}
            for name, step in steps.items()
        },
    }


def captures_left(opened: OpenSession, free: int) -> int | None:
    """Return how many further pages the disk takes, None before the first.

    By the mean of the latest ones.
    """
    sizes = opened.page_sizes()
    return int(free / (sum(sizes) / len(sizes))) if sizes and sum(sizes) else None


def stamp(time: datetime) -> str:
    """A time as it is shown: ISO 8601, UTC."""
    return time.isoformat(timespec="milliseconds").replace("+00:00", "Z")
