"""The process that restores pages: started by `process`.

It answers one call after the other on the connection. When the process that started it ends, however that may be, the
lifeline is closed: the work that is under way is abandoned in order, so that it counts as interrupted, not as a crash.
"""

from __future__ import annotations

import os
import resource
import signal
import sys
import threading
import time
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from pathlib import Path
from types import FrameType
from typing import Any

from station.errors import Fault, Stopped, explain

IDLE_S, IDLE = 60.0, 75  # without work for so long a process gives its memory back by ending, with this exit code
GRACE_S = 5.0  # for the abandoned work to remove its files
INTERRUPTED = 128 + signal.SIGTERM


def main(connection: int, lifeline: int, memory_mib: int, scratch: Path) -> int:
    """Answer calls until none come for a while or the caller has gone.

    memory_mib: limit of the data segment, 0 for none; a page that needs more fails with MemoryError.
    scratch: its own folder for temporary files, which goes with it.
    Returns the exit code.
    """
    if memory_mib:
        resource.setrlimit(resource.RLIMIT_DATA, (memory_mib * 2**20, memory_mib * 2**20))
    signal.signal(signal.SIGTERM, _stop)
    threading.Thread(target=_end_with_caller, args=(lifeline,), daemon=True).start()
    try:
        code = _answer_calls(connection, lifeline)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)  # it ends already
    except Stopped:
        code = INTERRUPTED
    finally:
        with suppress(OSError):  # where a library left a file there
            scratch.rmdir()
    return code


def _answer_calls(connection: int, lifeline: int) -> int:
    """Answer calls until none come for a while or the caller has gone.

    The lifeline is waited for here as well: a signal that arrives just before the system begins to wait does not end
    the wait. Returns the exit code.
    """
    with Connection(connection) as caller, suppress(EOFError, ConnectionError):
        while ready := wait([caller, lifeline], IDLE_S):
            if lifeline in ready:
                return INTERRUPTED
            caller.send(answer(caller.recv()))
    return IDLE


def answer(call: tuple[Any, tuple[Any, ...]]) -> tuple[str, Any]:
    """Return the value of a function called, or its fault: `value`, `memory` or `fault`.

    A full memory is distinguished: it is the process that has too little.
    """
    function, arguments = call
    try:
        return "value", function(*arguments)
    except Exception as error:
        fault = explain(error)
        kind = "memory" if isinstance(error, MemoryError) else "fault"
        return kind, Fault(fault.exit_code, fault.message, fault.hints)


def _stop(number: int, _frame: FrameType | None) -> None:
    signal.signal(number, signal.SIG_IGN)  # a second one would interrupt the removal of files
    raise Stopped(number)


def _end_with_caller(lifeline: int) -> None:
    """Wait until the caller has gone; then interrupt the work.

    The process is ended when the work does not let go.
    """
    with suppress(OSError):
        os.read(lifeline, 1)
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(GRACE_S)
    os._exit(INTERRUPTED)


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:4]]
    sys.exit(main(numbers[0], numbers[1], numbers[2], Path(sys.argv[4])))
