"""Jobs: long work in separate processes, one at a time, with progress and outcome."""

from __future__ import annotations

import asyncio
import json
import os
import sys
from collections import OrderedDict
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

from station.console.faults import ConsoleFault

MAX_KEPT = 50  # jobs that have ended
MAX_WAITING = 20
MAX_ITEMS = 1000
MAX_LINE_BYTES = 2**22  # of a message of a process: a thousand problems in a line each
COMMAND = (sys.executable, "-m", "station.console.work")
STATE = Literal["waiting", "running", "done", "failed", "cancelled"]
ENDED = ("done", "failed", "cancelled")


@dataclass(eq=False)
class Job:
    """A job. about: what it is about, shown; task: what its process reads."""

    id: str
    kind: str
    about: Mapping[str, Any]
    task: Mapping[str, Any]
    state: STATE = "waiting"
    stage: str | None = None
    done: float | None = None
    started: datetime | None = None
    ended: datetime | None = None
    items: list[dict[str, Any]] = field(default_factory=list)
    result: dict[str, Any] | None = None
    error: dict[str, Any] | None = None

    def as_json(self) -> dict[str, Any]:
        """The job as it is shown."""
        times = {"started": self.started, "ended": self.ended}
        result = self.result
        if result is not None and "folder" in result:
            result = {**result, "download": f"/api/jobs/{self.id}/files"}
        return {
            "id": self.id,
            "kind": self.kind,
            "state": self.state,
            "stage": self.stage,
            "done": self.done,
            **{
                name: None if time is None else time.isoformat(timespec="milliseconds").replace("+00:00", "Z")
                for name, time in times.items()
            },
            "about": dict(self.about),
            "items": self.items[-MAX_ITEMS:],
            "result": result,
            "error": self.error,
        }

    def hear(self, message: Mapping[str, Any]) -> None:
        """Take a message of the process."""
        match message:
            case {"progress": [str(stage), (float() | int()) as done]}:
                self.stage, self.done = stage, float(done)
            case {"item": dict(item)}:
                self.items.append(item)
            case {"result": dict(result)}:
                self.result, self.state, self.done = result, "done", 1.0
            case {"error": dict(error)}:
                self.error, self.state = error, "failed"


class Jobs:
    """The jobs of this start. `begin` and `cancel` may be called from any thread.

    changed is called with a job when it has changed; command is that of the process.
    """

    def __init__(
        self, changed: Callable[[Job], None], now: Callable[[], datetime], *, command: tuple[str, ...] = COMMAND
    ) -> None:
        self._changed, self._now, self._command = changed, now, command
        self._jobs: OrderedDict[str, Job] = OrderedDict()
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._turn: asyncio.Lock | None = None

    def start(self) -> None:
        """Work from now on, in the running loop."""
        self._loop, self._turn = asyncio.get_running_loop(), asyncio.Lock()

    async def stop(self) -> None:
        """End every process, and wait for it."""
        tasks = list(self._tasks.values())
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    def all(self) -> list[Job]:
        """The jobs, the newest first."""
        return list(reversed(list(self._jobs.values())))

    def find(self, number: str) -> Job:
        """A job by its id. Raises ConsoleFault."""
        job = self._jobs.get(number)
        if job is None:
            raise ConsoleFault("not_found", f"the job {number} does not exist", "jobs are those of this start")
        return job

    def begin(self, kind: str, about: Mapping[str, Any], task: Mapping[str, Any]) -> Job:
        """Queue a task, and return its job.

        Raises ConsoleFault when too many wait.
        """
        loop = self._loop
        if loop is None:
            raise ConsoleFault("ending", "the server is ending")
        if sum(job.state == "waiting" for job in self._jobs.values()) >= MAX_WAITING:
            raise ConsoleFault("busy", f"{MAX_WAITING} jobs wait already", "wait until one has ended")
        number = str(max((int(known) for known in self._jobs), default=0) + 1)
        job = self._jobs[number] = Job(number, kind, about, {**task, "kind": kind})
        ended = [known for known, one in self._jobs.items() if one.state in ENDED]
        for known in ended[: max(len(ended) - MAX_KEPT, 0)]:
            del self._jobs[known]
        loop.call_soon_threadsafe(self._plan, job)
        self._changed(job)
        return job

    def cancel(self, number: str) -> Job:
        """End a job. One that has ended stays as it is."""
        job, loop = self.find(number), self._loop
        task = self._tasks.get(number)
        if task is not None and loop is not None and job.state not in ENDED:
            loop.call_soon_threadsafe(task.cancel)
        return job

    def _plan(self, job: Job) -> None:
        task = asyncio.get_running_loop().create_task(self._run(job))
        self._tasks[job.id] = task
        task.add_done_callback(lambda _task: self._tasks.pop(job.id, None))

    async def _run(self, job: Job) -> None:
        assert self._turn is not None
        try:
            async with self._turn:
                job.state, job.started = "running", self._now()
                self._changed(job)
                await self._work(job)
                if job.state == "running":
                    job.state = "failed"
                    text = "the process of this job has ended"
                    job.error = {"text": text, "hint": "start it again", "kinds": ["process_ended"]}
        except asyncio.CancelledError:
            job.state = "cancelled"
        finally:
            job.ended = self._now()
            self._changed(job)

    async def _work(self, job: Job) -> None:
        process = await asyncio.create_subprocess_exec(
            *self._command,
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.DEVNULL,
            limit=MAX_LINE_BYTES,
            start_new_session=True,  # a batch has processes of its own: all end together
        )
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(json.dumps(job.task).encode() + b"\n")
            process.stdin.close()
            async for line in process.stdout:
                with suppress(ValueError):
                    job.hear(json.loads(line))
                    self._changed(job)
            await process.wait()
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, 9)
            await process.wait()


def files_of(job: Job) -> list[tuple[str, Path]]:
    """Return (name, path) of each file that a job has written, by name.

    Links are left out. Raises ConsoleFault.
    """
    folder = None if job.result is None else job.result.get("folder")
    if folder is None:
        raise ConsoleFault("not_found", f"job {job.id} has written no files")
    root = Path(str(folder))
    found = []
    for base, folders, names in os.walk(root):
        folders.sort()
        paths = [Path(base) / name for name in sorted(names)]
        found += [
            (path.relative_to(root).as_posix(), path) for path in paths if path.is_file() and not path.is_symlink()
        ]
    return found
