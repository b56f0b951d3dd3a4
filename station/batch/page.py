"""Work on one name of a folder, in a separate process.

Its scans are restored or quarantined.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from restore import RangeScan, RestoredPage, SurfaceMesh
from station.batch.preview import preview
from station.errors import FolderInUse, OverwriteError, explain
from station.intake.arrival import OF_A_NAME, PASSING, Arrival, Changed
from station.intake.once import Restore, Settled, restore_once
from station.run.destination import Destination, Outcome
from station.run.one_page import restore_file
from station.run.options import RunOptions
from station.run.peak_memory import peak_memory_mib
from station.verdict.measures import measured

AGAIN = "run the batch again"
GONE = f"it changed or went away while the batch ran; {AGAIN}"
BEFORE_PX = 160  # of the scan, next to its page of twice the size: it shows the shape, and costs a fifth of the bytes
POLL_S = 1.0  # another process has the page: a worker that was given up by the cluster, but is still alive
MAX_CLASHES = 5  # with files that another scan has written in the meantime
MAX_TRIES = 3600  # of them: the longest page takes a fraction of an hour


@dataclass(frozen=True)
class Task:
    """Scans of one name, restored one after the other: arrivals, results' folder, options."""

    arrivals: tuple[Arrival, ...]
    out: Path
    options: RunOptions

    @property
    def size(self) -> int:
        """Bytes of all its files."""
        return sum(arrival.size for arrival in self.arrivals)

    @property
    def name(self) -> str:
        """The first scan, relative to the folder of the batch."""
        return str(self.arrivals[0].source)


@dataclass(frozen=True)
class TaskDone:
    """What became of a task: one result for each of its scans.

    seconds   wall time. memory_mib: peak of the process that did it, so far. pid, host: of that process.
    previews  a page's file → its preview. To read a page again takes ten times as long as to make that of its pixels.
    """

    settled: tuple[Settled, ...]
    seconds: float
    memory_mib: float
    pid: int
    host: str
    previews: Mapping[Path, str] = field(default_factory=dict)


def restore_task(
    task: Task,
    causes: Sequence[str] = (),
    *,
    restore: Restore | None = None,
    clock: Callable[[], float] = time.perf_counter,
    sleep: Callable[[float], None] = time.sleep,
) -> TaskDone:
    """Restore or quarantine the scans of a task.

    What an earlier run or another worker has done is not done again.
    causes: how the processes ended that tried before.
    Raises errors that are not the scan's fault: of the disk, the settings, this computer.
    """
    start, previews = clock(), dict[Path, str]()
    restore = restore or _with_previews(previews)
    settled = tuple(_settle(arrival, task, causes, restore, sleep) for arrival in task.arrivals)
    return TaskDone(settled, clock() - start, peak_memory_mib(), os.getpid(), os.uname().nodename, previews)


def _with_previews(previews: dict[Path, str]) -> Restore:
    """Restore scans with their pages measured, and add previews of the pages to some."""

    def restore(
        source: Path, destination: Destination, options: RunOptions, *, facts: Mapping[str, Any], stem: str | None
    ) -> Outcome:
        made: list[str] = []

        def examine(page: RestoredPage, scan: RangeScan | SurfaceMesh) -> Mapping[str, Any]:
            before = "" if scan.texture is None else preview(scan.texture, BEFORE_PX)
            made.append(before + preview(page.image))
            return measured(page, scan)

        outcome = restore_file(source, destination, options, facts=facts, stem=stem, examine=examine)
        reports = [one.files[-1] for one in outcome.pages or (outcome,)]
        if len(made) == len(reports):  # else a sheet was not written after all
            previews.update(zip((report.with_suffix(".png") for report in reports), made, strict=True))
        return outcome

    return restore


def _settle(
    arrival: Arrival, task: Task, causes: Sequence[str], restore: Restore, sleep: Callable[[float], None]
) -> Settled:
    """Restore a scan, after any other process that is at it has ended."""
    original = arrival.folder / arrival.source
    for attempt in range(MAX_TRIES):
        try:
            with tempfile.TemporaryDirectory(prefix="planish-") as staged:
                return restore_once(
                    arrival, task.out, task.options, Path(staged), restore, causes=causes, memory_is_shared=True
                )
        except Changed:
            return Settled("set aside", original, GONE)
        except OverwriteError as error:
            if attempt >= MAX_CLASHES:
                return Settled("set aside", original, str(error))
            sleep(POLL_S)
        except (FolderInUse, FileNotFoundError):  # its folder was free, and there, a moment ago
            if not all((arrival.folder / path).exists() for path in arrival.files.values()):
                return Settled("set aside", original, GONE)
            if attempt == MAX_TRIES - 1:
                raise
            sleep(POLL_S)
        except OSError as error:
            if error.errno in PASSING:
                return Settled("set aside", original, f"cannot be read just now: {error.strerror}; {AGAIN}")
            if error.errno in OF_A_NAME:
                return Settled("set aside", original, explain(error).message)
            raise
    raise AssertionError  # the last try returns or raises
