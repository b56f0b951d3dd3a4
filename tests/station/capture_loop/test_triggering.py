"""Shots of a scanner that is triggered by hand are captured without a key."""

from __future__ import annotations

from queue import SimpleQueue
from threading import Event
from types import SimpleNamespace

import pytest

from station.capture_loop.triggering import UNKNOWN_LASER, laser_note, triggered
from tests.station.conftest import StandInScanner

WAIT_S = 60.0


class HandTriggered(StandInScanner):
    """A scanner with a number of shots that wait."""

    def __init__(self) -> None:
        super().__init__()
        self.waiting, self.asked = 0, Event()

    def wait(self, seconds: float) -> bool:
        self.asked.set()
        return self.waiting > 0 or bool(Event().wait(min(seconds, 0.001)))


def test_each_shot_that_waits_is_captured_once_and_a_key_takes_it_away():
    scanner, pressed = HandTriggered(), []
    loop = SimpleNamespace(inbox=SimpleQueue(), press=pressed.append)
    with triggered(scanner, loop):
        scanner.waiting = 1
        task = loop.inbox.get(timeout=WAIT_S)
        task()
        assert pressed == ["capture"]
        scanner.waiting = 0
        task()
        assert pressed == ["capture"]


def test_a_scanner_with_a_key_is_left_alone():
    with triggered(StandInScanner(), None), triggered(None, None):
        pass


@pytest.mark.parametrize(("driver", "note"), [("simulated", ""), ("vivid900", ""), ("program", UNKNOWN_LASER)])
def test_a_laser_in_an_unknown_state_is_reported(driver, note):
    assert laser_note({"driver": driver}) == note
