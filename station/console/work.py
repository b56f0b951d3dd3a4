"""The work of a job, in a separate process.

`python -m station.console.work` reads a task and writes its outcome. A line of JSON each: the task on standard input;
on standard output `progress`, `item`, and `result` or `error` at last.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from station.archive.check import check_export
from station.archive.deliver import deliver
from station.archive.formats import Format
from station.archive.from_session import scan_of, volume_of
from station.batch.progress import Event
from station.batch.runner import run_batch
from station.console.faults import problem_of
from station.progress import Progress
from station.run.options import RunOptions
from station.session import read_session
from station.session.fixity.verify import verify
from station.storage.disk import free_folder
from station.workers.background import prepare_worker
from station.workers.executors import local_workers
from station.workers.process import Limits

Send = Callable[[dict[str, Any]], None]
Result = dict[str, Any]
MAX_PROBLEMS = 1000  # that are reported one by one


def run(task: Mapping[str, Any], send: Send) -> None:
    """Do a task; report its progress, and its result or error at last."""

    def progress(stage: str, done: float) -> None:
        send({"progress": [stage, done]})

    try:
        send({"result": KINDS[task["kind"]](task, progress, send)})
    except Exception as error:
        send({"error": problem_of(error)})


def export(task: Mapping[str, Any], progress: Progress, _send: Send) -> Result:
    """Write a session to a new folder, then check every file of it."""
    stored, out = read_session(Path(task["session"])), free_folder(Path(task["out"]))
    out.parent.mkdir(parents=True, exist_ok=True)
    delivery = deliver(
        volume_of(stored),
        Format(task["format"]),
        out,
        address=str(task.get("url") or "").rstrip("/"),
        now=datetime.now(UTC),
        source=partial(scan_of, stored),
        progress=progress,
    )
    progress("check", 0.0)
    problems = [problem.text for problem in check_export(out)]
    sizes = [path.stat().st_size for path in out.rglob("*") if path.is_file()]
    return {
        "folder": str(out),
        "files": len(sizes),
        "bytes": sum(sizes),
        "missing": list(delivery.missing),
        "valid": not problems,
        "problems": problems[:MAX_PROBLEMS],
    }


def batch(task: Mapping[str, Any], progress: Progress, send: Send) -> Result:
    """Restore what is to be restored in sessions, each page in a process of its own."""
    counts: dict[str, int] = {}
    count = int(task.get("workers") or len(os.sched_getaffinity(0)))
    limits = Limits(threads=max(len(os.sched_getaffinity(0)) // count, 1))

    def show(event: Event) -> None:
        counts[event.state] = counts.get(event.state, 0) + 1
        send({"item": {"name": event.name, "state": event.state, "text": event.text}})
        if event.done is not None:
            progress(str(event.done), event.done.fraction)

    sessions = [Path(session) for session in task["sessions"]]
    finished = run_batch(sessions, free_folder(Path(task["out"])), RunOptions(), local_workers(count, limits), show)
    return {
        "restored": counts.get("restored", 0),
        "set_aside": counts.get("set aside", 0),
        "folder": str(finished.report.parent),
        "report": str(finished.report),
    }


def check(task: Mapping[str, Any], _progress: Progress, _send: Send) -> Result:
    """Compare every file of a session with what its events say."""
    inspection = verify(Path(task["session"]))
    problems = [{"page": one.page, "path": one.path, "kind": one.kind, "text": one.text} for one in inspection.problems]
    return {"files": len(inspection.found), "problems": problems[:MAX_PROBLEMS]}


KINDS: Mapping[str, Callable[[Mapping[str, Any], Progress, Send], Result]] = {
    "export": export,
    "batch": batch,
    "verify": check,
}


def main() -> None:
    """Do the task of standard input. The process ends with the one that started it."""
    prepare_worker(os.getppid())
    lines = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # whatever a library prints

    def send(message: dict[str, Any]) -> None:
        print(json.dumps(message), file=lines, flush=True)

    with lines:
        run(json.loads(sys.stdin.readline()), send)


if __name__ == "__main__":
    main()
