"""Where pages are restored: this computer or a Dask cluster.

Each page is in a separate process either way.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, Protocol

from station.errors import UsageError
from station.workers.cluster import GONE, RESUME, Cluster, ClusterGone, ShortOfMemory
from station.workers.process import Isolation, Limits, Work

__all__ = ["GONE", "RESUME", "ClusterGone", "ShortOfMemory", "Submit", "Workers", "cluster_workers", "local_workers"]

CONNECT_S, CLOSE_S = 30.0, 5.0
AHEAD = 2  # tasks handed out for every thread of a cluster: the next is there when one ends
NOISY = ("distributed.", "tornado.")
EXTRA = "install the extra: pip install 'planish[cluster]'"


class Submit(Protocol):
    """Hands out a task; the future's result is that of work(task, causes).

    above_mib: the memory of one worker that was too little, 0 for none.
    """

    def __call__(self, work: Work[Any], task: Any, above_mib: int = 0) -> Future[Any]: ...


@dataclass(frozen=True)
class Workers:
    """Something that restores pages.

    submit     hands out a task.
    in_flight  how many tasks it should have at a time, now.
    threads    how many it restores at a time, now.
    stranded   those of some futures whose workers are all gone: they never end.
    """

    submit: Submit
    in_flight: Callable[[], int]
    threads: Callable[[], int]
    stranded: Callable[[Iterable[Future[Any]]], list[Future[Any]]] = lambda _futures: []


@contextmanager
def local_workers(count: int, limits: Limits) -> Iterator[Workers]:
    """Yield processes of this computer.

    When the block ends, however that may be, they have ended.
    """
    isolation = Isolation(limits)
    executor = ThreadPoolExecutor(count, thread_name_prefix="planish-batch")

    def submit(work: Work[Any], task: Any, above_mib: int = 0) -> Future[Any]:  # noqa: ARG001 — all have as much
        return executor.submit(isolation.run, work, task)

    try:
        yield Workers(submit, lambda: count, lambda: count)
    finally:
        isolation.interrupt()
        executor.shutdown(cancel_futures=True)
        isolation.close()


@contextmanager
def cluster_workers(address: str, limits: Limits, say: Callable[[str], None] = lambda _text: None) -> Iterator[Workers]:
    """The workers of a Dask cluster, by the address of its scheduler.

    say: called when no worker of it can be used for CONNECT_S, with the reasons.
    Raises UsageError when the extra `cluster` is not installed, ClusterGone when nothing answers there.
    """
    try:
        import distributed
    except ImportError as error:
        raise UsageError("a cluster needs dask.distributed, which is not installed", EXTRA) from error
    # It reports a lost connection with tracebacks, some by loggers with levels of their own; the batch says so itself.
    for name in (
        "distributed",
        "tornado",
        *(name for name in logging.root.manager.loggerDict if name.startswith(NOISY)),
    ):
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        client = distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise ClusterGone(
            f"no scheduler answers at {address}: {error}", "start one with: dask scheduler --port 8786"
        ) from error
    cluster = Cluster(client, limits, say)
    try:
        yield Workers(cluster.submit, lambda: AHEAD * cluster.wait_for_threads(), cluster.threads, cluster.stranded)
    finally:
        with suppress(OSError, TimeoutError):  # the scheduler may have gone
            client.close(timeout=CLOSE_S)
