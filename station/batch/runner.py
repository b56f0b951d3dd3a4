"""A whole batch: folders of scans and sessions in one run, and its report."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from datetime import datetime
from itertools import chain, count
from pathlib import Path
from typing import Protocol

from station.batch.folders import FolderBatch
from station.batch.outcomes import PageOutcome
from station.batch.progress import Show
from station.batch.report import encode_report
from station.batch.sessions import SessionBatch
from station.errors import UsageError
from station.intake import records
from station.run.options import RunOptions
from station.session import open_session
from station.storage.atomic import lock_output_folder, write_all
from station.storage.session_folder import is_session, refuse_session
from station.verdict.thresholds import Thresholds
from station.workers.executors import Workers

REPORT = "report.html"
NO_LIMITS = Thresholds()


class Part(Protocol):
    """The pages of one kind of source."""

    def run(self, workers: Workers, show: Show) -> None: ...

    def pages(self) -> Iterable[PageOutcome]: ...


@dataclass(frozen=True)
class Finished:
    """Batch that has ended.

    report: its path.
    pages: every page of its sources, as it is now.
    """

    report: Path
    pages: tuple[PageOutcome, ...]

    @property
    def set_aside(self) -> list[PageOutcome]:
        """The pages that could not be restored, now or in an earlier run."""
        return [page for page in self.pages if page.state == "set aside"]


def run_batch(
    sources: Sequence[Path],
    output: Path,
    options: RunOptions,
    workers: AbstractContextManager[Workers],
    show: Show,
    *,
    limits: Thresholds = NO_LIMITS,
    now: Callable[[], datetime] = records.utc,
) -> Finished:
    """Restore what is to do in folders of scans and in sessions.

    Folders are restored into `output`. The report is written whatever ends the batch.
    limits: of the quality check on pages of folders; sessions have their own.
    Returns the report and every page. Raises UsageError, FolderInUse, BadInput for a damaged session, OSError when the
    disk refuses, StationError for other faults that are not a page's.
    """
    sessions = [source for source in sources if is_session(source)]
    folders = [source for source in sources if source not in sessions]
    refuse_session(output)
    if sessions and options.colours is not None:
        raise UsageError(
            f"{sessions[0]} is a session, whose pages take no profile",
            "leave --icc-profile and the profile of --white-balance out",
        )
    with ExitStack() as stack:
        lock = stack.enter_context(lock_output_folder(output))
        writers = {str(session): stack.enter_context(open_session(session)) for session in sessions}
        parts: list[Part] = [SessionBatch(writers, options)] if writers else []
        parts += [FolderBatch(folders, output, options, limits)] if folders else []
        places = stack.enter_context(workers)
        try:
            for part in parts:
                part.run(places, show)
        finally:
            title = f"Batch of {', '.join(source.name for source in sources)}"
            pages = [page for part in parts for page in part.pages()]
            report = _place_of_report(output)
            write_all([(report, encode_report(pages, title=title, now=now()))], force=True, lock=lock)
    return Finished(report, tuple(pages))


def _place_of_report(output: Path) -> Path:
    """Return where the report is written: next to a folder of results that has its name."""
    names = chain([REPORT], (f"report-{number}.html" for number in count(2)))
    return next(path for name in names if not (path := output / name).is_dir())
