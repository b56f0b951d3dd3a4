"""Progress on stderr: bars on a terminal, lines when verbose, nothing when quiet."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from enum import IntEnum
from time import monotonic
from typing import TextIO

COMPILING = "compiling, once"
WHOLE = "whole run"
"""The stage for all stages of a run together; its bar shows the time left."""
EARLY, LATE = 0.1, 0.99  # fractions of a run: before the first its speed is not known, after the second it is over
SECONDS, MINUTES = 10, 120  # the time left is rounded to as many seconds; beyond the second, to minutes


class Verbosity(IntEnum):
    """How much a command prints on stderr besides errors."""

    QUIET = 0  # nothing
    NORMAL = 1  # notes, and bars on a terminal
    VERBOSE = 2  # notes, and a line for each stage that begins


verbosity: ContextVar[Verbosity] = ContextVar("verbosity", default=Verbosity.NORMAL)

Progress = Callable[[str, float], None]
"""Called with the name of the stage and the fraction done, 0 to 1."""


def time_left(elapsed: float, fraction: float) -> str:
    """Return how long a run still takes, as text, empty while it is not known.

    elapsed: seconds for `fraction` of its time.
    """
    if not EARLY <= fraction <= LATE:
        return ""
    seconds = elapsed * (1 - fraction) / fraction
    if seconds > MINUTES:
        return f"about {round(seconds / 60)} min left"
    return f"about {max(round(seconds / SECONDS), 1) * SECONDS} s left"


def silent(_stage: str, _fraction: float) -> None:
    """Show nothing."""


@contextmanager
def progress_on(stream: TextIO | None) -> Iterator[Progress]:
    """Show progress on `stream` while the block runs: bars, one a stage, if it is a terminal.

    Verbose, a line for each stage that begins, on any stream. Otherwise, and when quiet, nothing. A stream that was
    closed before the program began is None. A stage that waits for the compilation of kernels is labelled: it takes
    seconds, and looks like a fault.
    """
    level = verbosity.get()
    if stream is not None and level == Verbosity.VERBOSE:
        yield _lines_on(stream)
        return
    if stream is None or level == Verbosity.QUIET or not stream.isatty():
        yield silent
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskID, TaskProgressColumn, TextColumn, TimeElapsedColumn

    from restore.runtime import notify_when_compiling

    start = monotonic()
    columns = TextColumn("{task.description:<12}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(file=stream), transient=True) as bars:
        tasks: dict[str, TaskID] = {}

        def show(stage: str, fraction: float) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=1.0)
            bars.update(tasks[stage], completed=fraction)
            if stage == WHOLE:
                left = time_left(monotonic() - start, fraction)
                bars.update(tasks[stage], description=f"{WHOLE}: {left}" if left else WHOLE)

        def show_compiling() -> None:
            begun = [stage for stage in tasks if stage != WHOLE]
            if begun:  # the last of them goes on now
                bars.update(tasks[begun[-1]], description=f"{begun[-1]}: {COMPILING}")

        with notify_when_compiling(show_compiling):
            yield show


def _lines_on(stream: TextIO) -> Progress:
    """Write a line for each stage that begins, with the seconds since the first one."""
    start, begun = monotonic(), {WHOLE}

    def show(stage: str, _fraction: float) -> None:
        if stage not in begun:
            begun.add(stage)
            print(f"{monotonic() - start:7.1f} s  {stage}", file=stream, flush=True)

    return show
