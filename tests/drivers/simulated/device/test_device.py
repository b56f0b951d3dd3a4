"""The simulated device by its bytes alone, and what its sensor adds up."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.scanner import TransportError
from drivers.scsi import commands as scsi
from drivers.scsi.sense import Sense, parse_sense
from drivers.scsi.transport import BUSY, CHECK_CONDITION, GOOD, Reply
from drivers.simulated.device.clock import VirtualClock
from drivers.simulated.device.device import SELF_TEST_S, Lens, SimulatedDevice
from drivers.simulated.imaging.sensor import quantise
from drivers.vivid900.capture.pitch import build_pitch, parse_pitch, pitch_length
from drivers.vivid900.geometry.lenses import FAST
from drivers.vivid900.profile import commands
from drivers.vivid900.profile.commands import Command, Parameters, ShotMode, Status
from drivers.vivid900.profile.profile import SIMULATED, load_profile
from oracles.simulation.plate import PlateSensor

PROFILE = load_profile(SIMULATED)
FINE_S = 2.5
ROUNDING = 0.05  # share of the noise that rounding may add on paper: in quadrature a thousandth


class Host:
    """Sends bytes to a device and nothing else."""

    def __init__(self) -> None:
        self.clock = VirtualClock()
        self.device = SimulatedDevice(Lens("MIDDLE", 14, PlateSensor()), PROFILE, self.clock)

    def send(self, command: Command) -> Reply:
        return self.device.execute(command.cdb, command.data_out, command.data_in_length)

    def refused(self, command: Command) -> Sense:
        assert self.send(command).status == CHECK_CONDITION
        return self.sense()

    def sense(self) -> Sense:
        return parse_sense(self.device.execute(scsi.request_sense(18), b"", 18).data)

    def status(self) -> Status:
        return commands.parse_status(PROFILE, self.send(commands.status(PROFILE)).data)

    def set(self, **parameters: int) -> None:
        block = commands.build_parameters(PROFILE, Parameters(**parameters))
        assert self.send(commands.write_parameters(PROFILE, block)).status == GOOD


@pytest.fixture
def host() -> Host:
    host = Host()
    assert host.refused(Command("", bytes(6))).code == 0x29  # power-on, reported once
    return host


def test_power_on_is_reported_once_and_inquiry_ignores_it() -> None:
    host = Host()
    assert host.device.execute(scsi.inquiry(), b"", 36).data[8:15] == b"PLANISH"
    assert str(host.refused(commands.status(PROFILE))) == "UNIT ATTENTION 29h/00h"
    assert host.status().state == "ready"
    assert host.sense().code == 0


def test_the_self_test_takes_ten_seconds(host: Host) -> None:
    host.device.power_off()
    with pytest.raises(TransportError, match="no device"):
        host.status()
    host.device.power_on()
    assert host.refused(Command("", bytes(6))).code == 0x29
    assert str(host.refused(Command("", bytes(6)))) == "NOT READY 04h/01h"
    assert host.status().state == "warming-up"
    host.clock.sleep(SELF_TEST_S)
    assert host.send(Command("", bytes(6))).status == GOOD


def test_the_laser_burns_during_the_sweep_and_no_longer(host: Host) -> None:
    host.set(laser_power=50, mode=ShotMode.FINE_COLOUR)
    assert not host.device.log.laser_is_on
    host.send(commands.release(PROFILE))
    assert host.device.log.laser_is_on
    assert host.status().state == "busy"
    assert host.send(commands.read_parameters(PROFILE)).status == BUSY
    host.clock.sleep(FINE_S)
    assert not host.device.log.laser_is_on
    host.clock.sleep(1)
    assert host.status().state == "data"
    assert [beam.power for beam in host.device.log.beams] == [50]


@pytest.mark.parametrize("what", ["power_off", "reset"])
def test_what_ends_a_sweep_ends_the_beam(host: Host, what: str) -> None:
    host.set(laser_power=50)
    host.send(commands.release(PROFILE))
    host.clock.sleep(1)
    getattr(host.device, what)()
    assert not host.device.log.laser_is_on
    assert host.device.log.beams[0].end == pytest.approx(1.0)


def test_power_zero_switches_the_laser_off(host: Host) -> None:
    host.set(laser_power=0)
    host.send(commands.release(PROFILE))
    assert not host.device.log.beams


def test_between_fine_and_fast_a_motor_turns(host: Host) -> None:
    ready = []
    for mode in (ShotMode.FINE_COLOUR, ShotMode.FAST_COLOUR, ShotMode.FAST_COLOUR):
        host.set(mode=mode, laser_power=1)
        start = host.clock()
        host.send(commands.release(PROFILE))
        while host.status().state == "busy":
            host.clock.sleep(0.01)
        ready.append(host.clock() - start)
    assert ready == pytest.approx([3.0, 1.8, 0.8], abs=0.011)


def test_parameters_are_remembered_until_it_is_switched_off(host: Host) -> None:
    host.set(distance_mm=777, gain=3)
    read = commands.read_parameters(PROFILE)
    assert commands.parse_parameters(PROFILE, host.send(read).data) == Parameters(distance_mm=777, gain=3)
    host.device.reset()
    assert host.refused(read).code == 0x29
    assert commands.parse_parameters(PROFILE, host.send(read).data) == Parameters()


@pytest.mark.parametrize(
    ("command", "sense"),
    [
        (Command("", bytes.fromhex("1b 00 00 00 00 00")), "ILLEGAL REQUEST 20h/00h"),
        (Command("", bytes.fromhex("c3 00 00 00 00 00 00 00 00 01")), "ILLEGAL REQUEST 24h/00h"),
        (Command("", b""), "ILLEGAL REQUEST 20h/00h"),
        (Command("", bytes.fromhex("c1 00 00 00 00 00 00 00 10 00"), bytes(16)), "ILLEGAL REQUEST 26h/00h"),
        (Command("", bytes.fromhex("c1 00 00 00 00 00 00 00 10 00"), b""), "ILLEGAL REQUEST 26h/00h"),
        (commands.read_pitch(PROFILE, 0, 10), "ILLEGAL REQUEST 2Ch/00h"),
        (commands.read_colour(PROFILE, ShotMode.COLOUR_8, 0, 10), "ILLEGAL REQUEST 2Ch/00h"),
    ],
)
def test_what_it_does_not_understand_it_refuses(host: Host, command: Command, sense: str) -> None:
    assert str(host.refused(command)) == sense


def test_beyond_the_end_of_an_image_there_is_nothing(host: Host) -> None:
    host.set(mode=ShotMode.FAST_COLOUR, laser_power=60)
    host.send(commands.release(PROFILE))
    host.clock.sleep(5)
    total = pitch_length(PROFILE, FAST)
    assert len(host.send(commands.read_pitch(PROFILE, total - 10, 10)).data) == 10
    assert host.refused(commands.read_pitch(PROFILE, total - 10, 11)).code == 0x24
    assert host.refused(commands.read_colour(PROFILE, ShotMode.MONITOR, 0, 10)).code == 0x24


def test_a_lens_change_loses_the_data_and_is_reported(host: Host) -> None:
    host.set(mode=ShotMode.FAST_COLOUR, laser_power=60)
    host.send(commands.release(PROFILE))
    host.clock.sleep(5)
    host.device.change_lens(Lens("WIDE", 8, PlateSensor(lens="WIDE")))
    assert host.refused(commands.status(PROFILE)).code == 0x28
    host.clock.sleep(SELF_TEST_S)
    status = host.status()
    assert (status.state, status.lens, status.lens_serial) == ("ready", "WIDE", 8)


def test_a_threshold_loses_what_is_darker(host: Host) -> None:
    seen = []
    for threshold in (0, 1023):
        host.set(mode=ShotMode.FAST_COLOUR, laser_power=60, distance_mm=900, threshold=threshold)
        host.send(commands.release(PROFILE))
        host.clock.sleep(5)
        data = host.send(commands.read_pitch(PROFILE, 0, pitch_length(PROFILE, FAST))).data
        seen.append(np.isfinite(parse_pitch(PROFILE, FAST, data).frames).mean())
    assert seen == [1.0, 0.0]


def test_rounding_is_small_next_to_the_noise() -> None:
    rng = np.random.default_rng(6)
    pitch = rng.uniform(20, 250, (240, 320))
    signal = rng.uniform(0.04, 3.9, pitch.shape)
    signal[rng.random(pitch.shape) < 0.1] = 0.0
    back = parse_pitch(PROFILE, FAST, build_pitch(PROFILE, quantise(pitch, signal), 1)).frames
    noise = 0.02 / FAST.step * np.sqrt(np.maximum(0.5 / np.maximum(signal, 0.038), 1))  # of the optics, in frames
    bright = signal > 0
    assert (np.abs(back - pitch)[bright] < noise[bright] / 2).all()
    assert np.sqrt(np.mean((back - pitch)[signal > 0.5] ** 2)) < ROUNDING * 0.02 / FAST.step
