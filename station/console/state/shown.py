"""The state of the station as it is shown."""

from __future__ import annotations

import shutil
from datetime import datetime
from pathlib import Path
from typing import Any

from station.console.state.control import Control
from station.console.state.jobs import Jobs
from station.console.state.open_session import Sitting
from station.console.state.scanner import ScannerOwner
from station.session.history import redo_target, undo_target
from station.session.overview import missing_labels
from station.version import software_version

SHOWN_JOBS = 20


def state_of(
    root: Path,
    sitting: Sitting | None,
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
        "session": None if sitting is None else session_state(sitting),
        "recovery": None if sitting is None else sitting.recovery,
        "disk": {
            "free_bytes": usage.free,
            "total_bytes": usage.total,
            "shots_left": None if sitting is None else shots_left(sitting, usage.free),
        },
        "control": control.as_json(),
        "jobs": [job.as_json() | {"items": job.items[-1:]} for job in jobs.all()[:SHOWN_JOBS]],
        "failed": failed,
    }


def session_state(sitting: Sitting) -> dict[str, Any]:
    """The open session: what it is of, how far it is, what undo and redo would do."""
    session, rows = sitting.session, sitting.rows()
    volume, history = session.volume, session.history
    steps = {"undo": undo_target(history), "redo": redo_target(history)}
    numbers = {row["page"] for row in rows}
    return {
        "name": sitting.name,
        "id": session.identifier,
        "title": volume.title,
        "project": volume.project,
        "organisation": volume.organisation,
        "preset": volume.preset,
        "folder": str(sitting.folder),
        "read_only": sitting.is_read_only,
        "held_by": sitting.held_by or None,
        "events": len(history.events),
        "pages": len(rows),
        "current": sitting.page if sitting.page in numbers else None,
        "restoring": sitting.restoring,
        "missing": missing_labels(session),
        **{
            name: None if step is None else {"step": step.name, "page": step.page or None}
            for name, step in steps.items()
        },
    }


def shots_left(sitting: Sitting, free: int) -> int | None:
    """How many further pages the disk takes, by the mean of the latest ones; None before the first."""
    sizes = sitting.page_sizes()
    return int(free / (sum(sizes) / len(sizes))) if sizes and sum(sizes) else None


def stamp(time: datetime) -> str:
    """A time as it is shown: ISO 8601, UTC."""
    return time.isoformat(timespec="milliseconds").replace("+00:00", "Z")
