"""Scanners that are triggered by hand: each shot that waits is captured without a key."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from threading import Event, Thread
from typing import Any

from drivers import Scanner, driver_of
from drivers.scanner import SelfTriggered
from station.capture_loop.loop import CaptureLoop

WAIT_S = 1.0  # at most until the end of the loop is noticed
UNKNOWN_LASER = "nothing is known of this scanner's laser: look at the scanner itself"


def laser_note(config: Mapping[str, Any]) -> str:
    """Return what to say once of a scanner whose laser is not known of, or nothing."""
    return "" if "laser" in driver_of(config).facts else UNKNOWN_LASER


@contextmanager
def triggered(scanner: Scanner | None, loop: CaptureLoop) -> Iterator[None]:
    """Have the loop capture each shot that waits, as long as the block lasts."""
    if not isinstance(scanner, SelfTriggered):
        yield
        return
    ended = Event()

    def capture() -> None:
        if scanner.wait(0):  # a key may have captured it meanwhile
            loop.press("capture")

    def follow() -> None:
        while not ended.is_set():
            if scanner.wait(WAIT_S):
                loop.inbox.put(capture)
                ended.wait(WAIT_S)

    thread = Thread(target=follow, name="trigger")
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
