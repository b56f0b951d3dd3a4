"""Derive the pages of a session: scan, restoration, quality check.

The service owns the rules of a page; its callers own threads, processes and the inbox.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

from restore.runtime import Kept, LibraryMissing
from station.errors import StationError
from station.intake.once import is_range_image
from station.run.attempts import Failure, FromCauses, InMemory, attempted
from station.run.options import AUTO, READING, RunOptions
from station.run.peak_memory import peak_memory_mib
from station.session.captures.scans import scan_path
from station.session.corrections.layers import rules_of
from station.session.derivation.fitting import show_fitting
from station.session.derivation.parameters import inputs_of, needs_restoration, parameters_of
from station.session.derivation.quality import lacks_verdict, record_verdict
from station.session.derivation.restoration import Run, run_restore
from station.session.log.current import preset_of
from station.session.log.events import Event
from station.session.log.history import Page, Restoration, restoration_of
from station.session.log.results import QualityCheck
from station.session.log.steps import record_run
from station.session.log.store import Session, Writer
from station.session.terms.parts import RESTORE
from station.session.terms.presets import Preset
from station.session.terms.rules import Rule

KEPT = Kept()  # of this process: a page that is corrected by hand is flattened once
OF_THE_COMPUTER = (OSError, StationError, LibraryMissing, MemoryError)  # faults that are not of the scan

Step = Literal["restore", "check"]
Submit = Callable[[Path, Mapping[str, Any], Path], "Future[Run]"]
"""`run_restore` in the background, with a future for its result."""


@dataclass(frozen=True)
class Job:
    """A scan to restore.

    session  its folder. files: of the scan. folder: an empty one for the files of the restoration.
    inputs   the corrections that the parameters follow from.
    """

    session: Path
    capture: Event
    source: Path
    files: tuple[Path, ...]
    parameters: Mapping[str, Any]
    folder: Path
    inputs: tuple[Event, ...]

    @cached_property
    def size(self) -> int:
        """Bytes of the scan."""
        return sum(path.stat().st_size for path in self.files)


@dataclass(frozen=True)
class Done:
    """A job that has ended in the background."""

    job: Job
    future: Future[Run]


@dataclass(frozen=True)
class Made:
    """What a process made of a job, its seconds and its memory."""

    result: Run | Failure
    seconds: float
    memory_mib: float


@dataclass(frozen=True)
class Settled:
    """A restoration as it was recorded, and its quality check where a part of it was measured."""

    run: Restoration
    quality: QualityCheck | None


def next_step(session: Session, page: Page, rules: Sequence[Rule] | None = None) -> Step | None:
    """Return what a page lacks; None without a scan, and where it is restored and checked.

    rules: of the session, where they are known.
    """
    if needs_restoration(session, page, rules):
        return "restore"
    return "check" if lacks_verdict(page) else None


def restore_keeping(source: Path, parameters: Mapping[str, Any], folder: Path) -> Run:
    """Restore a stored scan with what this process computed of it before."""
    with KEPT.of_page(source):
        return run_restore(source, parameters, folder, kept=KEPT)


def restore_job(job: Job, causes: Sequence[str] = ()) -> Made:
    """Restore a scan in a process that is there for it.

    causes: how the processes ended that tried before; after two it is not tried again.
    Raises errors that are not the scan's fault: of the disk, the settings, this computer.
    """
    start = time.perf_counter()
    shutil.rmtree(job.folder, ignore_errors=True)  # of a process that has ended
    made = attempted(
        lambda: run_restore(job.source, job.parameters, job.folder), FromCauses(causes), fatal=OF_THE_COMPUTER
    )
    return Made(made, time.perf_counter() - start, peak_memory_mib())


@dataclass
class Derivation:
    """The restorations and quality checks of a session.

    options  those that are given override the session's preset.
    outputs  files of a restoration in addition to those of the preset.
    facts    what is recorded with each restoration.
    checked  is called with the page and each check that was missing, and not for new restorations.
    """

    writer: Writer
    options: RunOptions | None = None
    outputs: tuple[str, ...] = ()
    facts: Mapping[str, str] = field(default_factory=dict)
    checked: Callable[[int, QualityCheck], None] = lambda _page, _check: None
    _attempts: dict[int, InMemory] = field(default_factory=dict)

    def due(self, *, page: int | None = None, running: Container[int] = ()) -> Iterator[Event]:
        """Yield the scans that have to be restored, and check the restorations that lack a check.

        Of all pages earlier restorations that fit are shown first. page: only this one.
        running: scans whose restoration is under way.
        """
        history = self.writer.history
        if page is None:
            show_fitting(self.writer)  # of a step that was interrupted
        rules = rules_of(self.writer.session)
        for one in list(history.pages()) if page is None else [history.captured(page)]:
            if one is None or one.capture.number in running:
                continue
            step = next_step(self.writer.session, one, rules)
            if step == "restore":
                yield one.capture
            elif step == "check":
                self.checked(one.number, record_verdict(self.writer, one.runs[RESTORE]))

    def job(self, capture: Event) -> Job:
        """Plan the restoration of a scan as its page is corrected now."""
        session = self.writer.session
        page, source = session.history.captured(capture.page), scan_path(session, capture)
        assert page is not None
        parameters = parameters_of(session, page, _preset(preset_of(session), self.options))
        if self.options is not None:
            given = {name: getattr(self.options, name) for name in READING if name != "unit"}
            parameters = {name: value for name, value in given.items() if value != AUTO} | parameters
            if parameters["unit"] == AUTO and not is_range_image(source):
                parameters["unit"] = self.options.unit
        parameters["outputs"] = sorted({*parameters["outputs"], *self.outputs})
        folder = self.writer.staging(f"restore-{capture.number}")
        shutil.rmtree(folder, ignore_errors=True)
        files = tuple(session.path(capture, file) for file in capture.files)
        return Job(session.folder, capture, source, files, parameters, folder, tuple(inputs_of(session, page)))

    def settle(self, job: Job, made: Run | Failure) -> Settled:
        """Record what became of a scan, and check its quality. Raises OSError."""
        run = _failed(job.folder, made) if isinstance(made, Failure) else made
        event = record_run(
            self.writer,
            RESTORE,
            job.capture,
            parameters=job.parameters,
            result=run.result,
            files=job.folder,
            facts={**run.facts, **self.facts},
            others=job.inputs,
        )
        recorded = restoration_of(event)
        return Settled(recorded, record_verdict(self.writer, event) if recorded.result.is_measured else None)

    def settle_done(self, done: Done) -> Settled | None:
        """Record a restoration of the background; None where it crashed and is to begin again.

        Any fault but one of the disk costs the page and not the program.
        """
        attempts = self._attempts.setdefault(done.job.capture.number, InMemory())
        made: Run | Failure | None
        try:
            made = attempted(done.future.result, attempts, fatal=(OSError, BrokenProcessPool))
        except BrokenProcessPool:
            made = attempts.crash()
        return None if made is None else self.settle(done.job, made)


def _failed(folder: Path, failure: Failure) -> Run:
    """Return a run without a page, in an empty folder."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return Run({"error": failure.text, "hint": " ".join(failure.hints)})


def _preset(preset: Preset, options: RunOptions | None) -> Preset:
    """Return the preset with the options that were given on the command line."""
    if options is None:
        return preset
    settings = {**preset.settings, **options.settings.model_dump(exclude_unset=True)}
    return preset.model_copy(
        update={"settings": settings, "outputs": tuple(sorted({*preset.outputs, *options.outputs}))}
    )
