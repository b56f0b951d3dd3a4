"""Hands out the pages of a batch, longest first.

As many at a time as there are workers; a result for each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from typing import Any, TypeVar

from station.errors import StationError
from station.workers.executors import GONE, RESUME, ClusterGone, ShortOfMemory, Workers
from station.workers.process import Work

POLL_S = 5.0  # between two looks whether the workers are still there
MAX_LOST = 3  # times that a cluster loses the worker of one task: each of them had its own chance with the page

Item = TypeVar("Item")
Result = TypeVar("Result")


def run(tasks: Sequence[Item], workers: Workers, work: Work[Result]) -> Iterator[tuple[Item, Result]]:
    """Yield each task with its result, in the order in which they end.

    The tasks are taken in the order given. Raises StationError for a fault that is not a page's, ClusterGone when the
    scheduler does not answer any more.
    """
    waiting, lost, needed = list(reversed(tasks)), dict[int, int](), dict[int, int]()
    running: dict[Future[Result], Item] = {}
    while waiting or running:
        while waiting and len(running) < workers.in_flight():
            task = waiting.pop()
            running[_submitted(workers, work, task, needed.get(id(task), 0))] = task
        done = wait(running, POLL_S, FIRST_COMPLETED).done
        for future in [] if done else workers.stranded(running):
            waiting.append(running.pop(future))
            future.cancel()
        for future in done:
            task = running.pop(future)
            try:
                yield task, future.result()
            except ShortOfMemory as short:
                needed[id(task)] = short.mib
                waiting.append(task)
            except CancelledError:
                raise ClusterGone(GONE, RESUME) from None
            except StationError:
                raise
            except Exception as error:
                if not _is_lost_worker(error):
                    raise
                lost[id(task)] = lost.get(id(task), 0) + 1
                if lost[id(task)] >= MAX_LOST:
                    raise ClusterGone(
                        f"the cluster has lost {MAX_LOST} workers with one page: {error}", RESUME
                    ) from error
                waiting.append(task)


def _submitted(workers: Workers, work: Callable[..., Result], task: Any, above_mib: int) -> Future[Result]:
    try:
        return workers.submit(work, task, above_mib)
    except RuntimeError as error:  # a client that has been closed takes nothing
        raise ClusterGone(GONE, RESUME) from error


def _is_lost_worker(error: Exception) -> bool:
    """Whether Dask has given a task up because the machines that had it went away."""
    return type(error).__name__ in ("KilledWorker", "NoValidWorkerError", "CommClosedError")
