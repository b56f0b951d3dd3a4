"""Ways out of a capture over each transport: a sample of what `python -m bench.ways_out` runs in full."""

from __future__ import annotations

import random
import signal
from collections.abc import Iterator

import pytest

from drivers.scsi.pipes import Pipes
from drivers.scsi.usb import UsbBulkOnly
from drivers.vivid900.capture.body import Body
from oracles.bus_faults import RIGS
from oracles.faults import FaultRig, count_commands, small_profile
from oracles.ways_out import (
    KILLED_RIGS,
    ServedDevice,
    count_calls,
    ending_handlers,
    full_disk_violation,
    kill_violation,
    never,
    real_kill_violation,
    signal_violation,
)

SEED, POINTS, MANY_POINTS = 3, 8, 24
POWER = 68  # of the laser in the child's capture
IN_THE_SHOT = 20  # a command after the release: the laser's power is set


@pytest.fixture
def rig(request: pytest.FixtureRequest) -> Iterator[FaultRig]:
    made = RIGS[request.param](small_profile())
    yield made
    made.close()


@pytest.fixture(scope="module")
def commands() -> int:
    return count_commands(small_profile())


@pytest.mark.parametrize("rig", [name for name in RIGS if name != "in-process"], indirect=True)
@pytest.mark.parametrize("times", [1, 5])
def test_signals_over_a_bus(rig: FaultRig, commands: int, times: int) -> None:
    with ending_handlers():
        for command in random.Random(SEED).sample(range(commands), POINTS):
            assert signal_violation(rig, signal.SIGTERM, times, command) == "", f"at command {command}"


@pytest.mark.parametrize("rig", ["sg", "usb"], indirect=True)
def test_a_full_disk_over_a_bus(rig: FaultRig) -> None:
    for limit in (0, 1000, 300_000, 1_000_000):
        assert full_disk_violation(rig, limit) == "", f"after {limit} bytes"


@pytest.mark.parametrize("transport", KILLED_RIGS)
def test_the_first_start_after_kill_9_puts_the_laser_out(transport: str) -> None:
    rig = KILLED_RIGS[transport](small_profile())
    calls = count_calls(rig)
    for call in random.Random(SEED).sample(range(calls), POINTS):
        for after in (False, True):
            assert kill_violation(rig, call, after=after) == "", f"call {call}, after: {after}"


def test_without_reset_recovery_at_the_start_the_first_start_fails(monkeypatch) -> None:
    """The measure can fail: pipes that are left as the killed run left them."""
    made = UsbBulkOnly.__init__

    def out_of_step(self, *arguments, **options) -> None:
        made(self, *arguments, **options)
        self._out_of_step = False

    monkeypatch.setattr(UsbBulkOnly, "__init__", out_of_step)
    rig = KILLED_RIGS["usb"](small_profile())
    points = random.Random(SEED).sample(range(count_calls(rig)), MANY_POINTS)
    failed = [call for call in points if "start failed" in kill_violation(rig, call, after=True)]
    assert len(failed) > MANY_POINTS / 4


def test_a_kernel_driver_that_is_not_attached_again_is_found(monkeypatch) -> None:
    taken = Pipes.close

    def close(self) -> None:
        self._taken = False
        taken(self)

    monkeypatch.setattr(Pipes, "close", close)
    rig = KILLED_RIGS["usb"](small_profile())
    assert "not attached" in kill_violation(rig, IN_THE_SHOT, after=True)


def test_a_laser_that_is_left_on_is_found(monkeypatch) -> None:
    rig = KILLED_RIGS["sg"](small_profile())
    rig.camera.close()
    monkeypatch.setattr(Body, "laser_off", lambda self: None)
    assert "laser" in kill_violation(rig, IN_THE_SHOT, after=True)
    rig.close()


@pytest.fixture
def served() -> Iterator[ServedDevice]:
    device = ServedDevice()
    yield device
    device.close()


def test_a_process_killed_in_the_middle_of_a_shot(served: ServedDevice) -> None:
    """Really killed: the laser's power is set then, and any driver that opens the scanner sets it to 0."""

    def sweeping(served: ServedDevice) -> bool:
        return served.device.state == "busy" and served.device.parameters.laser_power == POWER

    assert real_kill_violation(served, sweeping) == ""
    set_to = [event.detail for event in served.device.log.named("parameters")]
    assert set_to[-3:] == [f"laser power {POWER}", "laser power 0", "laser power 0"]  # at the start and on closing


def test_a_process_that_was_not_killed_is_distinguished_from_one_that_was(served: ServedDevice) -> None:
    assert real_kill_violation(served, never) == "not killed"
