"""Where pages are restored: this computer or a Dask cluster, each page in a process of its own either way."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from typing import Any

from drivers import ScannerError
from station.errors import StationError, UsageError
from station.workers.process import Isolation, Limits, Result, Work

CONNECT_S, CLOSE_S = 30.0, 5.0
AHEAD = 2  # tasks handed out for every thread of a cluster: the next is there when one ends
REFRESH_S = 10.0
GONE = "the cluster's scheduler does not answer any more"
RESUME = "run the same command again: it goes on where it was"
EXTRA = "install the extra: pip install 'planish[cluster]'"


class ClusterGone(StationError):
    """Raised when a cluster's scheduler cannot be reached."""

    exit_code = ScannerError.exit_code


@dataclass(frozen=True)
class Workers:
    """Something that restores pages.

    submit     hands out a task; the future's result is that of work(task, causes).
    in_flight  how many tasks it should have at a time, now.
    threads    how many it restores at a time, now.
    """

    submit: Callable[[Work[Any], Any], Future[Any]]
    in_flight: Callable[[], int]
    threads: Callable[[], int]


@contextmanager
def local_workers(count: int, limits: Limits) -> Iterator[Workers]:
    """Processes of this computer; when the block ends, however that may be, they have ended."""
    isolation = Isolation(limits)
    executor = ThreadPoolExecutor(count, thread_name_prefix="planish-batch")
    try:
        yield Workers(lambda work, task: executor.submit(isolation.run, work, task), lambda: count, lambda: count)
    finally:
        isolation.interrupt()
        executor.shutdown(cancel_futures=True)
        isolation.close()


@contextmanager
def cluster_workers(address: str, limits: Limits) -> Iterator[Workers]:
    """The workers of a Dask cluster, by the address of its scheduler.

    Raises UsageError when the extra `cluster` is not installed, ClusterGone when nothing answers there.
    """
    try:
        import distributed
    except ImportError as error:
        raise UsageError("a cluster needs dask.distributed, which is not installed", EXTRA) from error
    # Its client reports a lost connection with tracebacks; the batch says so in one line.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        client = distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise ClusterGone(
            f"no scheduler answers at {address}: {error}", "start one with: dask scheduler --port 8786"
        ) from error
    executor: Executor = client.get_executor(pure=False)
    threads = _Threads(client)
    try:
        yield Workers(
            lambda work, task: executor.submit(run_on_worker, work, task, limits),
            lambda: AHEAD * threads.count(),
            threads.count,
        )
    finally:
        with suppress(OSError, TimeoutError):  # the scheduler may have gone
            client.close(timeout=CLOSE_S)


class _Threads:
    """The threads of a cluster, which come and go; the scheduler is asked now and then."""

    def __init__(self, client: Any) -> None:
        self._client, self._count, self._asked = client, 1, -REFRESH_S

    def count(self) -> int:
        """How many there are, at least 1. Raises ClusterGone."""
        if time.monotonic() - self._asked > REFRESH_S:
            try:
                self._count = max(sum(self._client.nthreads().values()), 1)
            except (OSError, TimeoutError) as error:
                raise ClusterGone(GONE, RESUME) from error
            self._asked = time.monotonic()
        return self._count


def run_on_worker(work: Work[Result], task: Any, limits: Limits) -> Result:
    """The value of work(task, causes) on a worker of a cluster, in a process of its own there.

    Without a limit of memory each of the worker's threads has an equal share of the memory that the worker was given.
    """
    import distributed

    if limits.memory_mib is None:
        worker = distributed.get_worker()
        given = worker.memory_manager.memory_limit or 0
        limits = replace(limits, memory_mib=int(given / worker.state.nthreads) // 2**20)
    return _isolations.setdefault(limits, Isolation(limits)).run(work, task)


_isolations: dict[Limits, Isolation] = {}  # of this worker of a cluster, which lives longer than a batch
