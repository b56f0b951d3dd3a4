"""Separate processes for pages.

A crash of a native library, a full memory or an endless loop costs one page. A page's process stays for the next page.
Each thread that hands out work has one, so that a process that ends names the page which ended it; a pool of processes
could only name all that were under way.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from station.errors import Fault, StationError
from station.workers.child import IDLE

# Variables by which a process learns how many threads it may use: BLAS, numba, OpenCV and restore's own.
THREADS = (
    *("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"),
    *("OPENCV_FOR_THREADS_NUM", "PLANISH_THREADS"),
)
GRACE_S = 10.0  # for the work of a process that has to end
MAX_ATTEMPTS = 2  # that may be cut off: by an operator, by a power cut; after that it is the scan that ends the program

Result = TypeVar("Result")
Work = Callable[[Any, tuple[str, ...]], Result]


@dataclass(frozen=True)
class Limits:
    """Limits of a process.

    memory_mib: 0: none; None: on a cluster a part of what the worker was given, none elsewhere.
    call_s: seconds for a call.
    calls: until the process is replaced.
    threads: of its kernels.
    """

    memory_mib: int | None = None
    call_s: float = 3600.0
    calls: int = 200
    threads: int = 1


class ProcessEnded(Exception):
    """Raised when the process of a page has ended; the message says how."""


class Interrupted(Exception):
    """The process of a page received a request to end."""


class WorkFault(StationError):
    """Raised for a fault that is not the page's: of the disk, the settings, the computer."""

    def __init__(self, fault: Fault) -> None:
        super().__init__(fault.message, fault.hints[0] if fault.hints else "")
        self.exit_code = fault.exit_code
        self.fault = fault
        for hint in fault.hints[1:]:
            self.add_note(hint)

    def __reduce__(self) -> tuple[type[WorkFault], tuple[Fault]]:
        return WorkFault, (self.fault,)


class MemoryFull(WorkFault):
    """Raised when a process has too little memory for its work."""

    def __reduce__(self) -> tuple[type[MemoryFull], tuple[Fault]]:
        return MemoryFull, (self.fault,)


class PageProcess:
    """Process that is called like a function.

    It is started by the first call, and again when it has ended.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None
        self._lifeline = -1
        self._calls = 0
        self._scratch = ""
        self._interrupted = False

    def call(self, function: Callable[..., Result], *arguments: Any) -> Result:
        """The value of a function of a module, computed by the process.

        Raises ProcessEnded when the process ended or took too long, MemoryFull, WorkFault when the function raised.
        """
        process, connection = self._running()
        self._calls += 1
        try:
            connection.send((function, arguments))
            if not connection.poll(self._limits.call_s):
                self._kill()
                raise ProcessEnded(f"it took longer than {self._limits.call_s:.0f} s")
            kind, value = connection.recv()
        except (EOFError, ConnectionError):
            code = process.wait()
            self.close()
            if code == IDLE:  # it had just given up waiting
                return self.call(function, *arguments)
            raise ProcessEnded(_how_it_ended(code)) from None
        if kind == "memory":
            raise MemoryFull(value)
        if kind == "fault":
            raise WorkFault(value)
        result: Result = value
        return result

    def interrupt(self) -> None:
        """Make the process abandon its work and end.

        The call that is under way raises ProcessEnded.
        """
        self._interrupted = True
        if (process := self._process) is not None:
            process.terminate()
            with suppress(subprocess.TimeoutExpired):
                process.wait(GRACE_S)
            process.kill()

    def close(self) -> None:
        """Make the idle process end, and wait until it has."""
        process, self._process = self._process, None
        if process is None:
            return
        with suppress(OSError):
            os.close(self._lifeline)
        if self._connection is not None:
            self._connection.close()
        with suppress(subprocess.TimeoutExpired):
            process.wait(GRACE_S)
        process.kill()
        process.wait()
        shutil.rmtree(self._scratch, ignore_errors=True)

    def _kill(self) -> None:
        if self._process is not None:
            self._process.kill()
        self.close()

    def _running(self) -> tuple[subprocess.Popen[bytes], Connection]:
        if self._process is not None and (self._calls >= self._limits.calls or self._process.poll() is not None):
            self.close()
        if self._process is None or self._connection is None:
            self._start()
            if self._interrupted and self._process is not None:  # in the meantime
                self._process.terminate()
        assert self._process is not None
        assert self._connection is not None
        return self._process, self._connection

    def _start(self) -> None:
        connection, theirs = Pipe()
        life, self._lifeline = os.pipe()
        fds = (theirs.fileno(), life)
        self._scratch = tempfile.mkdtemp(prefix="planish-")
        numbers = map(str, (*fds, self._limits.memory_mib or 0))
        words = [sys.executable, "-m", "station.workers.child", *numbers, self._scratch]
        variables = {name: str(self._limits.threads) for name in THREADS} | {"TMPDIR": self._scratch}
        try:
            # Results go through the connection; what native libraries print would spoil the output of the command. In a
            # session of its own Ctrl-C does not reach it: the batch ends it in order.
            self._process = subprocess.Popen(
                words,
                pass_fds=fds,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env=os.environ | variables,
                start_new_session=True,
            )
        finally:
            theirs.close()
            os.close(life)
        self._connection, self._calls = connection, 0


@dataclass
class Isolation:
    """Hands work to processes of their own, one for each thread that calls."""

    limits: Limits
    _processes: dict[int, PageProcess] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _closed: bool = False

    def run(self, work: Work[Result], task: Any, *, is_last: bool = True) -> Result:
        """Return the value of work(task, causes).

        It is called again when the process ends, with how that came about.
        is_last: False where another computer may have more memory.
        Raises WorkFault, MemoryFull where it is not the last, also for a process that ended under a limit, Interrupted
        after `interrupt`, ProcessEnded when the process ends however often it is called.
        """
        causes: tuple[str, ...] = ()
        while True:
            process = self._process()
            try:
                return process.call(work, task, causes)
            except MemoryFull as full:
                if not is_last or len(causes) >= MAX_ATTEMPTS:
                    raise
                causes += (str(full),)
            except ProcessEnded as ended:
                if self._closed:
                    raise Interrupted from ended
                if not is_last and self.limits.memory_mib:  # a native library that is given no memory aborts
                    raise MemoryFull(Fault(StationError.exit_code, str(ended), ())) from ended
                causes += (str(ended),)
                if len(causes) > MAX_ATTEMPTS:  # by then the work has set the page aside, unless it cannot even begin
                    raise

    def interrupt(self) -> None:
        """End all processes: calls that are under way raise Interrupted, as does every later one."""
        with self._lock:
            self._closed = True
        for process in self._processes.values():
            process.interrupt()

    def close(self) -> None:
        """End all processes, when no call is under way."""
        for process in self._processes.values():
            process.close()

    def _process(self) -> PageProcess:
        with self._lock:
            if self._closed:
                raise Interrupted
            return self._processes.setdefault(threading.get_ident(), PageProcess(self.limits))


def _how_it_ended(code: int) -> str:
    if code >= 0:
        return f"its process ended with {code}"
    try:
        return f"its process ended by {signal.Signals(-code).name}"
    except ValueError:
        return f"its process ended by signal {-code}"
