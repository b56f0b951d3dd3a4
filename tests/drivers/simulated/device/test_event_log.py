"""The log of a simulated device: events in order, and the laser on exactly while a beam lasts."""

import pytest

from drivers.simulated.device.event_log import Beam, Log


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def log(clock) -> Log:
    return Log(clock)


def test_events_have_their_time_and_are_found_by_name(log, clock):
    log.add("shot", "1")
    clock.now = 2.5
    log.add("halt")
    log.add("shot", "2")
    assert [(event.time, event.detail) for event in log.named("shot")] == [(0.0, "1"), (2.5, "2")]
    assert list(log.named("beam")) == []


@pytest.mark.parametrize(("now", "on"), [(0.9, False), (1.0, True), (2.9, True), (3.0, False)])
def test_the_laser_is_on_from_the_start_of_a_beam_until_before_its_end(log, clock, now, on):
    log.laser_on(1.0, 2.0, 40)
    clock.now = now
    assert log.laser_is_on is on


def test_without_power_there_is_darkness(log):
    log.laser_on(0.0, 5.0, 0)
    assert (log.beams, log.laser_is_on) == ([], False)


def test_cutting_off_shortens_the_beam_that_is_on_and_drops_the_one_to_come(log, clock):
    log.laser_on(0.0, 1.0, 9)
    log.laser_on(2.0, 2.0, 9)
    log.laser_on(6.0, 1.0, 9)
    clock.now = 3.0
    log.laser_off()
    assert not log.laser_is_on
    assert log.beams == [Beam(0.0, 1.0, 9), Beam(2.0, 3.0, 9)]
