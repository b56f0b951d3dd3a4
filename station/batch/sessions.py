"""A batch over sessions.

Each page without a current restoration is restored, and recorded in its session. Workers compute into folders on the
session's disk; the process of the batch, the session's only writer, records.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping

from station.batch.outcomes import PageOutcome, ci95_of, concerns, figures_of, texts_of
from station.batch.progress import Done, Event, Pace, Show
from station.batch.run_tasks import run
from station.run.options import RunOptions
from station.session import Session, Writer
from station.session.derivation.service import Derivation, Job, Made, restore_job
from station.session.leaves.leaf import Leaf, leaves_of, picture_of
from station.session.terms.parts import parts_of
from station.workers.executors import Workers
from station.workers.process import Work

ERROR = "error"  # in the result of a run that has no page


class SessionBatch:
    """Pages of sessions, by the names of their folders.

    The outcome of a scan is recorded, and not tried again.
    options: those that are given override the session's preset.
    """

    def __init__(self, writers: Mapping[str, Writer], options: RunOptions) -> None:
        facts = {"host": os.uname().nodename}
        self._writers = writers
        self._derivations = {
            writer.session.folder: Derivation(writer, options, facts=facts) for writer in writers.values()
        }

    def run(self, workers: Workers, show: Show, *, work: Work[Made] = restore_job) -> None:
        """Restore the pages without a restoration, record and check each.

        Raises as `run_tasks.run` does.
        """
        jobs = [one.job(capture) for one in self._derivations.values() for capture in one.due()]
        jobs.sort(key=lambda job: -job.size)
        pace = Pace(job.size for job in jobs)
        for job, made in run(jobs, workers, work):
            show(self.settle(job, made, pace.done(job.size, made.seconds, workers.threads())))

    def pages(self) -> Iterator[PageOutcome]:
        """Every page as its session has it now."""
        for writer in self._writers.values():
            for leaf in leaves_of(writer.session):
                yield _outcome(writer.session, leaf)

    def settle(self, job: Job, made: Made, batch: Done) -> Event:
        """Record what became of a page, and its verdict. batch: how far it is."""
        derivation = self._derivations[job.session]
        session = derivation.writer.session
        name = f"{session.volume.title}, page {job.capture.page}"
        settled = derivation.settle(job, made.result)
        run, result = settled.run, settled.run.result
        if settled.quality is None:
            return Event("set aside", name, next(str(leaf.error) for _, leaf in result.failures), batch)
        files = [run.file(part) for part, leaf in result.leaves.items() if leaf.measures]
        places = ", ".join(str(session.path(run.event, file)) for file in files if file)
        return Event("restored", name, f"{settled.quality.level}, {places}", batch)


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
