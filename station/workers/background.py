"""Work in a separate process.

The scanner never waits for it, and a crash costs one page.
"""

from __future__ import annotations

import ctypes
import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import active_children, get_context
from typing import Generic, ParamSpec, TypeVar

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
PR_SET_PDEATHSIG = 1  # prctl(2): the signal that a process gets when its parent ends
NICENESS = 5  # the process that talks to the scanner comes first


@contextmanager
def background(
    work: Callable[Arguments, Result], ready: Callable[[], object] | None = None
) -> Iterator[Callable[Arguments, Future[Result]]]:
    """A function that does the work in another process, with a future for its result.

    One at a time: a restoration itself uses the processors. A process that crashes is replaced.
    work, ready: of a module, as the process imports them. ready: done first, as the process starts now: it loads what
    the work needs, so that the first page does not wait for it.
    """
    pool = _Pool(work)
    try:
        if ready is not None:
            pool.executor().submit(ready)
        yield pool.submit
    except BaseException:
        pool.kill()
        raise
    finally:
        pool.close()


class _Pool(Generic[Arguments, Result]):
    def __init__(self, work: Callable[Arguments, Result]) -> None:
        self._work = work
        self._executor: Executor | None = None

    def submit(self, *arguments: Arguments.args, **options: Arguments.kwargs) -> Future[Result]:
        try:
            return self.executor().submit(self._work, *arguments, **options)
        except BrokenProcessPool:
            self.close()
            self._executor = None
            return self.submit(*arguments, **options)

    def executor(self) -> Executor:
        if self._executor is None:
            context = get_context("spawn")
            self._executor = ProcessPoolExecutor(1, context, initializer=prepare_worker, initargs=(os.getpid(),))
        return self._executor

    def kill(self) -> None:
        """End the process in the middle of its work.

        The scan is stored, and restored when the session is continued.
        """
        for child in active_children():
            child.kill()

    def close(self) -> None:
        if self._executor is not None:
            self._executor.shutdown(wait=True, cancel_futures=True)


def prepare_worker(parent: int) -> None:
    """Make this process end with its parent, leave Ctrl-C to it, and give way to it."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # which has ended before the signal was set
        os._exit(1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(NICENESS)
