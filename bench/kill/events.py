"""File events of a process, counted and made to fail by a library that is loaded before the C library's own."""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

SOURCE = Path(__file__).with_name("file_events.c")
PRELOAD = "LD_PRELOAD"
HANGING = -100  # in the place of an exit code
RAISED = 70  # exit code of a child that ends with an exception (sysexits.h: an internal error)


@dataclass(frozen=True)
class Fault:
    """What happens at an event: a signal, or an error, a negative number. lasting: the error stays."""

    name: str
    number: int
    lasting: bool = False


FAULTS = (
    Fault("SIGKILL", signal.SIGKILL),
    Fault("SIGTERM", signal.SIGTERM),
    Fault("SIGINT", signal.SIGINT),
    Fault("EIO, once", -errno.EIO),
    Fault("EIO, lasting", -errno.EIO, lasting=True),
    Fault("ENOSPC, lasting", -errno.ENOSPC, lasting=True),
)


def start_with_library() -> None:
    """Compile the library and start this process again with it; returns in the process that has it.

    Exits where there is no compiler.
    """
    if library := os.environ.pop(PRELOAD, ""):
        shutil.rmtree(Path(library).parent)
        return
    compiler = shutil.which("cc")
    if compiler is None:
        sys.exit("bench.kill needs a C compiler: sudo apt install gcc libc6-dev")
    library = str(Path(tempfile.mkdtemp()) / "file_events.so")
    subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", library, SOURCE, "-ldl"], check=True)
    os.execve(sys.executable, sys.orig_argv, {**os.environ, PRELOAD: library, "OMP_NUM_THREADS": "1"})


def count_events(work: Callable[[], int], folder: Path) -> tuple[int, int]:
    """The exit code of a function that runs in a child process, and how many events it had below the folder."""
    reader, writer = os.pipe()

    def counting() -> int:
        _library().arm(os.fsencode(folder), 0, 0, 0)
        code = work()
        os.write(writer, str(_library().events()).encode())
        return code

    try:
        code = in_child(counting)
        os.close(writer)
        return code, int(os.read(reader, 20) or b"0")
    finally:
        os.close(reader)


def with_fault(work: Callable[[], int], folder: Path, at: int, fault: Fault) -> int:
    """The exit code of a function in a child process that meets a fault at the event `at`, from 1 on."""

    def meeting() -> int:
        _library().arm(os.fsencode(folder), at, fault.number, int(fault.lasting))
        return work()

    return in_child(meeting)


def in_child(work: Callable[[], int], seconds: float = 60.0) -> int:
    """The exit code of a function that runs in a child process, its output left out; negative for a signal."""
    child = os.fork()
    if child == 0:
        _end_with(work)
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.002)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return HANGING


def _end_with(work: Callable[[], int]) -> None:
    """End this process with the exit code of the function."""
    nothing = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2):
        os.dup2(nothing, descriptor)
    code = RAISED
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a run in the background ignores it
    with suppress(BaseException):
        code = work()
    os._exit(code)


def _library() -> ctypes.CDLL:
    return ctypes.CDLL(None)
