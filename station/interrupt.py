"""Ctrl-C while a command is being loaded ends the process with the usual lines.

An exception would not do: imports of native libraries, and typer, turn a KeyboardInterrupt into something else.
"""

from __future__ import annotations

import os
import signal
from types import FrameType

EXIT_CODE = 128 + signal.SIGINT  # as a shell reports a process that the signal has ended
MESSAGE, HINT = "stopped by Ctrl-C", "run the same command again to start over"


def end_at_once(_number: int, _frame: FrameType | None) -> None:
    """Print the lines and end the process: a signal handler.

    Nothing has begun that would have to be closed.
    """
    os.write(2, f"planish: {MESSAGE}\n  {HINT}\n".encode())
    os._exit(EXIT_CODE)


def end_on_ctrl_c() -> None:
    """Let Ctrl-C end the process at once, unless the process ignores it."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, end_at_once)


def raise_on_ctrl_c() -> None:
    """Let Ctrl-C raise KeyboardInterrupt again.

    From here on work has to be ended in order.
    """
    if signal.getsignal(signal.SIGINT) is end_at_once:
        signal.signal(signal.SIGINT, signal.default_int_handler)
