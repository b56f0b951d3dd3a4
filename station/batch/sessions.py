"""A batch over sessions.

Each page without a current restoration is restored, and recorded in its session. Workers compute into folders on the
session's disk; the process of the batch, the session's only writer, records.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from restore.runtime import LibraryMissing
from station.batch.outcomes import PageOutcome, ci95_of, concerns, figures_of, texts_of
from station.batch.progress import Done, Event, Pace, Show
from station.batch.run_tasks import run
from station.errors import StationError, explain
from station.intake.once import is_range_image
from station.run.options import AUTO, READING, RunOptions
from station.run.peak_memory import peak_memory_mib
from station.session import Event as SessionEvent
from station.session import Session, Writer, record_run, scan_path
from station.session.corrections.layers import rules_of
from station.session.derivation.fitting import show_fitting
from station.session.derivation.parameters import inputs_of, needs_restoration, parameters_of
from station.session.derivation.quality import lacks_verdict, record_verdict
from station.session.derivation.restoration import Run, run_restore
from station.session.leaves.leaf import Leaf, leaves_of, picture_of
from station.session.log.current import preset_of
from station.session.log.history import restoration_of
from station.session.terms.parts import RESTORE, parts_of
from station.session.terms.presets import Preset
from station.workers.executors import Workers
from station.workers.process import MAX_ATTEMPTS, Work

ERROR = "error"  # in the result of a run that has no page


@dataclass(frozen=True)
class SessionTask:
    """A page to restore.

    source  its scan. folder: an empty one for its files. size: bytes of the scan.
    inputs  the corrections that the parameters follow from.
    """

    session: str
    page: int
    source: Path
    parameters: Mapping[str, Any]
    folder: Path
    size: int
    inputs: tuple[SessionEvent, ...] = ()


@dataclass(frozen=True)
class SessionDone:
    """Outcome of a page of a session.

    The run, whose result has `error` without a page; seconds, memory of the process.
    """

    run: Run
    seconds: float
    memory_mib: float


def restore_session_page(task: SessionTask, causes: Sequence[str] = ()) -> SessionDone:
    """Restore the scan of a page.

    causes: how the processes ended that tried before; after two it is not tried again.
    Raises errors that are not the scan's fault: of the disk, the settings, this computer.
    """
    start = time.perf_counter()
    shutil.rmtree(task.folder, ignore_errors=True)  # of a process that has ended
    if len(causes) >= MAX_ATTEMPTS:
        made = _failed(task, f"the program ended {len(causes)} times while it restored this scan: {causes[-1]}", "")
    else:
        try:
            made = run_restore(task.source, task.parameters, task.folder)
        except (OSError, StationError, LibraryMissing, MemoryError):  # a fault of the disk or of this computer
            raise
        except Exception as error:
            fault = explain(error)
            made = _failed(task, fault.message, " ".join(fault.hints))
    return SessionDone(made, time.perf_counter() - start, peak_memory_mib())


def _failed(task: SessionTask, error: str, hint: str) -> Run:
    """A run without a page, in an empty folder."""
    shutil.rmtree(task.folder, ignore_errors=True)
    task.folder.mkdir(parents=True)
    return Run({ERROR: error, "hint": hint})


class SessionBatch:
    """Pages of sessions, by the names of their folders.

    The outcome of a scan is recorded, and not tried again.
    options: those that are given override the session's preset.
    """

    def __init__(self, writers: Mapping[str, Writer], options: RunOptions) -> None:
        self._writers, self._options = writers, options

    def run(self, workers: Workers, show: Show, *, work: Work[SessionDone] = restore_session_page) -> None:
        """Restore the pages without a restoration, record and check each.

        Raises as `run_tasks.run` does.
        """
        for writer in self._writers.values():
            show_fitting(writer)  # of a step that was interrupted
            for page in filter(lacks_verdict, list(writer.history.pages())):  # of a batch that ended in between
                record_verdict(writer, page.runs[RESTORE])
        tasks = [task for name in self._writers for task in plan_session(name, self._writers[name], self._options)]
        tasks.sort(key=lambda task: -task.size)
        pace = Pace(task.size for task in tasks)
        for task, done in run(tasks, workers, work):
            show(self.settle(task, done, pace.done(task.size, done.seconds, workers.threads())))

    def pages(self) -> Iterator[PageOutcome]:
        """Every page as its session has it now."""
        for writer in self._writers.values():
            for leaf in leaves_of(writer.session):
                yield _outcome(writer.session, leaf)

    def settle(self, task: SessionTask, done: SessionDone, batch: Done) -> Event:
        """Record what became of a page, and its verdict. batch: how far it is."""
        writer = self._writers[task.session]
        name = f"{writer.session.volume.title}, page {task.page}"
        event = record_page(writer, task, done.run)
        restored = restoration_of(event)
        result = restored.result
        if not result.is_measured:
            return Event("set aside", name, next(str(leaf.error) for _, leaf in result.failures), batch)
        level = record_verdict(writer, event).level
        files = [restored.file(part) for part, leaf in result.leaves.items() if leaf.measures]
        places = ", ".join(str(writer.session.path(event, file)) for file in files if file)
        return Event("restored", name, f"{level}, {places}", batch)


def plan_session(name: str, writer: Writer, options: RunOptions) -> Iterator[SessionTask]:
    """Plan the pages that are not restored as they are corrected now."""
    session = writer.session
    preset, rules = _preset(preset_of(session), options), rules_of(session)
    for page in session.history.pages():
        if not needs_restoration(session, page, rules):
            continue
        source = scan_path(session, page.capture)
        parameters = parameters_of(session, page, preset)
        if parameters["unit"] == AUTO and not is_range_image(source):
            parameters["unit"] = options.unit
        given = {name: getattr(options, name) for name in READING if name != "unit"}
        parameters = {name: value for name, value in given.items() if value != AUTO} | parameters
        size = sum(session.path(page.capture, file).stat().st_size for file in page.capture.files)
        folder, inputs = writer.staging(f"batch-{page.number:04}"), tuple(inputs_of(session, page))
        yield SessionTask(name, page.number, source, parameters, folder, size, inputs)


def _preset(preset: Preset, options: RunOptions) -> Preset:
    """The preset with the options that were given on the command line."""
    settings = {**preset.settings, **options.settings.model_dump(exclude_unset=True)}
    return preset.model_copy(
        update={"settings": settings, "outputs": tuple(sorted({*preset.outputs, *options.outputs}))}
    )


def record_page(writer: Writer, task: SessionTask, made: Run) -> SessionEvent:
    """Record the restoration of a page, with the computer that made it, and return its event."""
    page = writer.history.captured(task.page)
    assert page is not None
    facts = {**made.facts, "host": os.uname().nodename}
    return record_run(
        writer,
        RESTORE,
        page.capture,
        parameters=task.parameters,
        result=made.result,
        files=task.folder,
        facts=facts,
        others=task.inputs,
    )


def _outcome(session: Session, leaf: Leaf) -> PageOutcome:
    name = f"{session.volume.title}, page {leaf.name}{f' ({leaf.label})' if leaf.label else ''}"
    run, restored = leaf.page.restoration, leaf.restored
    if run is None or restored is None:
        return PageOutcome(name, "missing", notes=("the batch has not come to it",))
    if restored.error is not None:
        return PageOutcome(name, "set aside", notes=tuple(filter(None, (restored.error, restored.hint))))
    report, size = parts_of(run.event.result)[leaf.part], restored.page_mm or (0.0, 0.0)
    return PageOutcome(
        name,
        "restored",
        picture_of(session, leaf),
        figures_of(report),
        (*concerns(leaf.checks), *texts_of(report)),
        (size[0], size[1]),
        run.seconds,
        leaf.level,
        ci95_of(report),
    )
