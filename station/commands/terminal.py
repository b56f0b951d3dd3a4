"""Output of the command: results on stdout, errors on stderr."""

from __future__ import annotations

import os
import re
import signal
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Protocol, TextIO, runtime_checkable

import typer

from station.errors import SIGNAL_BASE, STANDARD_OUTPUT, USAGE, Fault, Stopped, explain
from station.interrupt import raise_on_ctrl_c
from station.progress import Verbosity, verbosity

# Sent by a service manager, and by a terminal that closes: both leave time to let the scanner go.
ENDING_SIGNALS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
CONTROLS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")  # all but line feed and tab
READER_GONE = SIGNAL_BASE + signal.SIGPIPE  # as a shell reports a program that writes to a pipe without a reader

# The sentences of typer and pydantic about the value of an option: `--rotate: '45' is not one of '0', '90'`.
VALUE = re.compile(r"^Invalid value for '?([^']+?)'?: (?:Value error, )?")
NOT_A_NUMBER = re.compile(r"([^:]+): Input should be a valid (number|integer).*")
NOT_A_CHOICE = re.compile(r"([^:]+): ('[^']*') is not one of ('[^']*'(?:, '[^']*')+)")


@runtime_checkable
class CommandLineError(Protocol):
    """Protocol of typer's errors about options and arguments, which it keeps private."""

    exit_code: int

    def format_message(self) -> str:
        """What is wrong with the command line."""


def occupy_standard_streams() -> None:
    """Open the null device in place of standard streams that are closed.

    The next file would otherwise get one of their numbers, and with it whatever a native library prints.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the smallest free number, which is this one


@contextmanager
def report_faults(*, debug: bool = False) -> Iterator[None]:
    """Run the block; report an error on stderr and exit with its code.

    In the operator's words, without a traceback; with `debug` the traceback comes first.
    """
    try:
        with _ending_signals_raise():
            yield
    except (typer.Exit, SystemExit):
        raise
    except BaseException as error:
        if debug:
            _print_error("".join(traceback.format_exception(error)).rstrip())
        fault = explain(error)
        print_fault(fault)
        raise typer.Exit(fault.exit_code) from None


def usage_fault(error: CommandLineError) -> Fault:
    """The fault that describes an error about options or arguments."""
    message = VALUE.sub(r"\1: ", error.format_message().rstrip("."))
    context = getattr(error, "ctx", None)
    command = context.command_path if context else "planish"
    if choice := NOT_A_CHOICE.fullmatch(message):
        option, given, allowed = choice.groups()
        *first, last = (value.strip(" '") for value in allowed.split(","))
        return Fault(USAGE, f"{option}: {given} is not an allowed value", (f"give {', '.join(first)} or {last}",))
    if wrong := NOT_A_NUMBER.fullmatch(message):
        kind = "whole number" if wrong[2] == "integer" else "number"
        return Fault(USAGE, f"{wrong[1]}: the value is not a {kind}", (f"give a {kind}; see {command} --help",))
    return Fault(USAGE, message[:1].lower() + message[1:], (f"see {command} --help",))


def print_fault(fault: Fault) -> None:
    """Print a fault on stderr, if that is open and is read."""
    _print_error("\n".join([f"planish: {fault.message}", *(f"  {hint}" for hint in fault.hints)]))


def _print_error(text: str) -> None:
    if sys.stderr is None:  # print would write on stdout
        return
    try:
        print(_escaped(text, sys.stderr), file=sys.stderr, flush=True)
    except OSError:
        sys.stderr = None  # the interpreter would try again at exit, and change the exit code


def print_result(text: str) -> None:
    """Print on stdout, with escapes.

    They stand for control characters and those outside its encoding. Raises typer.Exit when the reader is gone, OSError
    when the disk is full.
    """
    try:
        print(_escaped(text, sys.stdout), flush=True)  # a closed stdout is None, and print leaves it alone
    except OSError as error:
        sys.stdout = None  # the interpreter would try again at exit, and change the exit code
        if isinstance(error, BrokenPipeError):
            raise typer.Exit(READER_GONE) from None
        error.filename = STANDARD_OUTPUT
        raise


def print_note(text: str) -> None:
    """Print a line on stderr in addition to the result, unless the command is quiet."""
    if verbosity.get() == Verbosity.QUIET:
        return
    print(_escaped(text, sys.stderr), file=sys.stderr, flush=True)


def _escaped(text: str, stream: TextIO | None) -> str:
    """Return the text with escapes.

    For what the stream cannot hold, and for control characters, which a terminal obeys.
    """
    encoding = getattr(stream, "encoding", None) or "utf-8"
    text = CONTROLS.sub(lambda found: f"\\x{ord(found[0]):02x}", text)
    return text.encode(encoding, "backslashreplace").decode(encoding)


@contextmanager
def _ending_signals_raise() -> Iterator[None]:
    def stop(number: int, _frame: FrameType | None) -> None:
        raise Stopped(number)

    before = {number: signal.signal(number, stop) for number in ENDING_SIGNALS}
    raise_on_ctrl_c()
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
