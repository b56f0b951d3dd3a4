"""A batch over folders of scans: planned from the records of earlier runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from station.batch.outcomes import PageOutcome, outcomes
from station.batch.page import Task, TaskDone, restore_task
from station.batch.plan import check_names, plan_folder
from station.batch.progress import Done, Event, Pace, Show
from station.batch.report import MAX_PICTURES
from station.batch.run_tasks import run
from station.errors import UsageError
from station.intake.folders import batch_instead, check_folders
from station.run.options import RunOptions
from station.storage.folder_lock import recover
from station.verdict.thresholds import Thresholds
from station.workers.executors import Workers
from station.workers.process import Work


class FolderBatch:
    """Scans of folders.

    Of several folders, each has its results below its own name in `output`.
    limits: of the quality check on their pages.
    Raises UsageError for folders or presets that are not usable, OSError when a folder cannot be read.
    """

    def __init__(self, folders: Sequence[Path], output: Path, options: RunOptions, limits: Thresholds) -> None:
        self._limits, self._previews = limits, dict[Path, str]()
        self._plans = [plan_folder(folder, out, options) for folder, out in _places(folders, output).items()]

    def run(self, workers: Workers, show: Show, *, work: Work[TaskDone] = restore_task) -> None:
        """Restore or quarantine what is still to do.

        Reports sessions that are left out. Raises as `station.batch.run_tasks.run` does.
        """
        for session in (session for plan in self._plans for session in plan.sessions):
            show(Event("left out", str(session), batch_instead(session)))
        tasks = sorted((task for plan in self._plans for task in plan.tasks), key=lambda task: -task.size)
        pace = Pace(task.size for task in tasks)
        for task, done in run(tasks, workers, work):
            if len(self._previews) < MAX_PICTURES:  # of more pages the report shows some, and memory is finite
                self._previews.update(done.previews)
            for event in _events(task, done, pace.done(task.size, done.seconds, workers.threads())):
                show(event)

    def pages(self) -> Iterator[PageOutcome]:
        """Every page as its records have it now."""
        for plan in self._plans:
            for page in outcomes(plan, self._limits):
                known = "" if page.picture is None else self._previews.get(page.picture, "")
                yield replace(page, preview=known)


def _places(folders: Sequence[Path], output: Path) -> dict[Path, Path]:
    """Each folder of scans with the folder of its results."""
    if len(folders) > 1 and not check_names(folders):
        raise UsageError("two of the folders have the same name", "run them one after the other, or rename one")
    places = {folder: output if len(folders) == 1 else output / folder.name for folder in folders}
    for folder, out in places.items():
        check_folders(folder, out)
        recover(out)
    return places


def _events(task: Task, done: TaskDone, batch: Done) -> Iterator[Event]:
    for arrival, settled in zip(task.arrivals, done.settled, strict=True):
        text = f"{settled.reason} ({settled.place})" if settled.reason else str(settled.place)
        yield Event(settled.state, str(arrival.source), text, batch)
