"""One tab acts; the others are told which."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest

from station.console.faults import ConsoleFault
from station.console.state.control import GONE_S, Control, agent_of

ONE, TWO = "1" * 16, "2" * 16


class Clock:
    def __init__(self) -> None:
        self.time = 100.0

    def __call__(self) -> float:
        return self.time


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def control(clock: Clock) -> Control:
    return Control(clock, lambda: datetime(2026, 1, 2, tzinfo=UTC))


def test_the_first_tab_acts_and_the_second_is_shown_who_does(control):
    assert control.joined(ONE, "Firefox on Linux")
    assert not control.joined(TWO, "")
    control.require(ONE, "")
    with pytest.raises(ConsoleFault) as fault:
        control.require(TWO, "")
    assert fault.value.key == "read_only"
    assert fault.value.data["held_by"] == {"tab": ONE, "since": "2026-01-02T00:00:00.000Z", "agent": "Firefox on Linux"}


def test_a_reload_keeps_control_and_a_tab_that_is_gone_loses_it(control, clock):
    control.joined(ONE, "")
    control.left(ONE)
    clock.time += GONE_S / 2
    assert not control.joined(TWO, "")
    control.joined(ONE, "")
    clock.time += 10 * GONE_S
    assert control.as_json()["tab"] == ONE
    control.left(ONE)
    clock.time += GONE_S + 1
    assert control.as_json()["tab"] is None
    assert control.require(TWO, "")
    assert control.as_json()["tab"] == TWO


def test_two_streams_of_a_tab_are_one_tab(control, clock):
    control.joined(ONE, "")
    control.joined(ONE, "")
    control.left(ONE)
    clock.time += GONE_S + 1
    assert control.as_json()["tab"] == ONE


def test_control_is_taken_and_given_away(control):
    control.joined(ONE, "")
    control.take(TWO, "Chrome on Android")
    assert control.as_json()["agent"] == "Chrome on Android"
    with pytest.raises(ConsoleFault):
        control.require(ONE, "")
    control.release(ONE)
    assert control.as_json()["tab"] == TWO
    control.release(TWO)
    assert control.require(ONE, "")


def test_browsers_are_named():
    firefox = "Mozilla/5.0 (X11; Linux x86_64; rv:140.0) Gecko/20100101 Firefox/140.0"
    chrome = "Mozilla/5.0 (Linux; Android 15) AppleWebKit/537.36 (KHTML, like Gecko) Chrome/140.0 Safari/537.36"
    assert (agent_of(firefox), agent_of(chrome)) == ("Firefox on Linux", "Chrome on Android")
    assert agent_of("curl/8") == ""
