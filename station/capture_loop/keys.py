"""The operator's keys: strokes on a terminal, lines of a pipe, a serial foot-switch."""

from __future__ import annotations

import sys
import termios
import threading
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import IO, Literal, Protocol

from station.errors import UsageError

Action = Literal["capture", "accept", "again", "undo", "redo", "mark", "note", "help", "quit"]
ACTIONS: dict[str, Action] = {
    " ": "capture",
    "\r": "accept",
    "\n": "accept",
    "r": "again",
    "u": "undo",
    "U": "redo",
    "m": "mark",
    "n": "note",
    "?": "help",
    "q": "quit",
    "": "quit",  # the end of the input
    "\x04": "quit",
}
HELP = "space capture · enter accept · r capture again · u undo · U redo · m mark · n note · q leave"
SWITCH_BAUD = 9600
SWITCH_POLL_S = 0.2  # within which the thread sees that the loop has ended


class Switch(Protocol):
    """A serial line on which a pressed foot-switch sends any byte."""

    def read(self, size: int) -> bytes:
        """The bytes that have come within the line's timeout, empty for none."""
        ...

    def close(self) -> None:
        """Close the line."""
        ...


@contextmanager
def single_strokes(stream: IO[str]) -> Iterator[None]:
    """Let a terminal give every key at once while the block runs.

    Keys are not shown; a pipe stays as it is.
    """
    if not stream.isatty():
        yield
        return
    descriptor = stream.fileno()
    before = termios.tcgetattr(descriptor)
    tty.setcbreak(descriptor)
    try:
        yield
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


def read_keys(stream: IO[str], put: Callable[[str], None]) -> threading.Thread:
    """Give each character of a stream to `put`, from a thread.

    The empty string marks its end. Returns the thread.
    """

    def read() -> None:
        while True:
            key = stream.read(1)
            put(key)
            if not key:
                return

    thread = threading.Thread(target=read, name="keys", daemon=True)
    thread.start()
    return thread


@contextmanager
def foot_switch(port: str | None, press: Callable[[], None]) -> Iterator[None]:
    """Call `press` for every press of a foot-switch while the block runs.

    port: a serial port, None without a switch.
    Raises UsageError when the port cannot be opened.
    """
    if port is None:
        yield
        return
    line, ended = open_switch(port), threading.Event()
    thread = threading.Thread(target=_watch, args=(line, press, ended), name="foot-switch", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        line.close()


def open_switch(port: str) -> Switch:
    """The serial line of a foot-switch. Raises UsageError."""
    import serial

    try:
        line: Switch = serial.serial_for_url(port, SWITCH_BAUD, timeout=SWITCH_POLL_S)
    except (OSError, ValueError) as error:
        raise UsageError(f"the foot-switch at {port} cannot be opened: {error}", "see planish devices") from error
    return line


def _watch(line: Switch, press: Callable[[], None], ended: threading.Event) -> None:
    """A press sends one byte or several; those that come together are one press."""
    while not ended.is_set():
        try:
            pressed = line.read(1) and (line.read(4096) or True)
        except OSError:  # unplugged: the keyboard is still there
            print("the foot-switch is gone", file=sys.stderr, flush=True)
            return
        if pressed:
            press()
