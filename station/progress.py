"""Progress bars on a terminal; no output elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

COMPILING = "compiling, once"

Progress = Callable[[str, float], None]
"""Called with the name of the stage and the fraction done, 0 to 1."""


def silent(_stage: str, _fraction: float) -> None:
    """Show nothing."""


@contextmanager
def progress_on(stream: TextIO | None) -> Iterator[Progress]:
    """Bars on `stream` while the block runs, one a stage, if the stream is a terminal; `silent` otherwise.

    A stream that was closed before the program began is None.

    A stage that waits for the compilation of kernels is labelled: it takes seconds, and looks like a fault.
    """
    if stream is None or not stream.isatty():
        yield silent
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskID, TaskProgressColumn, TextColumn, TimeElapsedColumn

    from restore import notify_when_compiling

    columns = TextColumn("{task.description:<12}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(file=stream), transient=True) as bars:
        tasks: dict[str, TaskID] = {}

        def show(stage: str, fraction: float) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=1.0)
            bars.update(tasks[stage], completed=fraction)

        def show_compiling() -> None:
            for stage in list(tasks)[-1:]:  # the one that goes on now, when one has begun
                bars.update(tasks[stage], description=f"{stage}: {COMPILING}")

        with notify_when_compiling(show_compiling):
            yield show
