"""Output of the command: results on stdout, errors on stderr."""

from __future__ import annotations

import signal
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

import typer

from station.errors import Stopped, explain

# Sent by a service manager, and by a terminal that closes: both leave time to let the scanner go.
ENDING_SIGNALS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))


@contextmanager
def report_faults(*, debug: bool = False) -> Iterator[None]:
    """Run the block; report an error on stderr in the operator's words and exit with its code, without a traceback.

    With `debug` the traceback comes first.
    """
    try:
        with _ending_signals_raise():
            yield
    except (typer.Exit, SystemExit, BrokenPipeError):  # BrokenPipeError: whoever read the output has gone
        raise
    except BaseException as error:
        if debug:
            traceback.print_exception(error)
        fault = explain(error)
        print(f"planish: {fault.message}", *(f"  {hint}" for hint in fault.hints), sep="\n", file=sys.stderr)
        raise typer.Exit(fault.exit_code) from None


def print_result(text: str) -> None:
    """Print on stdout, with escapes for characters outside its encoding. Raises OSError when the disk is full."""
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"  # a closed stdout is None, and print leaves it alone
    try:
        print(text.encode(encoding, "backslashreplace").decode(encoding), flush=True)
    except OSError as error:
        sys.stdout = None  # the interpreter would try again at exit, and change the exit code
        error.filename = "what there is to tell"
        raise


@contextmanager
def _ending_signals_raise() -> Iterator[None]:
    def stop(number: int, _frame: FrameType | None) -> None:
        raise Stopped(number)

    before = {number: signal.signal(number, stop) for number in ENDING_SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
