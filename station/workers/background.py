"""Restorations in a process of their own, so that the scanner never waits for one, and a crash costs one page."""

from __future__ import annotations

import ctypes
import os
import signal
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from multiprocessing import active_children, get_context
from pathlib import Path
from typing import Any

from restore import restore
from station.session.stages import Run, run_restore
from station.warm_up import small_page

Submit = Callable[[Path, Mapping[str, Any], Path], "Future[Run]"]
PR_SET_PDEATHSIG = 1  # prctl(2): the signal that a process gets when its parent ends
NICENESS = 5  # the process that talks to the scanner comes first


@contextmanager
def background(*, ready: bool = False) -> Iterator[Submit]:
    """A function that restores a scan in another process: `run_restore` with a future for its result.

    One at a time: a restoration itself uses the processors. A process that crashes is replaced.
    ready: start the process now, and let it load what a restoration needs, so that the first page is not waited for.
    """
    pool = _Pool()
    try:
        if ready:
            pool.executor().submit(get_ready)
        yield pool.submit
    except BaseException:
        pool.kill()
        raise
    finally:
        pool.close()


class _Pool:
    def __init__(self) -> None:
        self._executor: Executor | None = None

    def submit(self, source: Path, parameters: Mapping[str, Any], folder: Path) -> Future[Run]:
        try:
            return self.executor().submit(run_restore, source, parameters, folder)
        except BrokenProcessPool:
            self.close()
            self._executor = None
            return self.submit(source, parameters, folder)

    def executor(self) -> Executor:
        if self._executor is None:
            context = get_context("spawn")
            self._executor = ProcessPoolExecutor(1, context, initializer=prepare_worker, initargs=(os.getpid(),))
        return self._executor

    def kill(self) -> None:
        """End the process in the middle of its work: the scan is stored, and restored when the session is taken up."""
        for child in active_children():
            child.kill()

    def close(self) -> None:
        if self._executor is not None:
            self._executor.shutdown(wait=True, cancel_futures=True)


def get_ready() -> None:
    """Load what a restoration needs, by one of a small page; what fails here is reported by the first page."""
    with suppress(Exception):
        restore(small_page())


def prepare_worker(parent: int) -> None:
    """Make this process end with its parent, leave Ctrl-C to it, and give way to it."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # which has ended before the signal was set
        os._exit(1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(NICENESS)
