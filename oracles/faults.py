"""The real driver over a simulated device whose answers fail by a script, and what must hold after every capture.

The capture gives the true scan or raises a declared error, in bounded time and commands; the device comes to rest; the
next capture gives the true scan.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import ClassVar

import numpy as np

from drivers.scanner import ScannerError
from drivers.scsi.in_process import InProcess
from drivers.scsi.transport import DEFAULT_TIMEOUT_S, Reply, Target, Transport
from drivers.simulated.device.clock import VirtualClock
from drivers.simulated.device.device import SELF_TEST_S, Lens, SimulatedDevice
from drivers.vivid900.capture.camera import CAPTURE_S, PARK_COMMAND_S, PARK_S, Vivid900
from drivers.vivid900.connecting import calibrations
from drivers.vivid900.geometry.lenses import LENSES
from drivers.vivid900.link import Link
from drivers.vivid900.profile.profile import SIMULATED, Profile, load_profile
from drivers.vivid900.settings import VividSettings
from oracles.simulation.device_faults import FAULTS, Fault, FaultyDevice, NoAnswer
from oracles.simulation.plate import DARKEST, SHADES, PlateSensor
from restore.scan import RangeScan

SETTINGS = VividSettings(mode="fast", laser_power=68, gain=0)  # autofocus, one shot, the range image and the colours
CHUNK_BYTES = 400_000  # two commands for the range image, three for the colours: first, middle and last behave alike
TRUE_MM = 0.01  # what rounding of the sums leaves of the plate's depth
# The capture's deadline, within which its last attempt ends, and the parking after it with its last command.
MAX_SECONDS, MAX_COMMANDS = CAPTURE_S + PARK_S + PARK_COMMAND_S, 2000


@dataclass(frozen=True)
class Verdict:
    """The outcome of one capture under faults, "scan" or the name of the error, and the rule it broke, or empty."""

    outcome: str
    violation: str = ""


@dataclass(frozen=True)
class Injection:
    """Faults of one capture: number of the command → fault of the device's connection, → name of a fault of the bus."""

    name: str
    device: Mapping[int, Fault] = field(default_factory=dict)
    bus: Mapping[int, str] = field(default_factory=dict)


class FaultRig:
    """A simulated device with a plate before it, a faulty connection to it, and the real driver over them.

    bus_faults  names of the faults that the bus itself can have.
    """

    bus_faults: ClassVar[Sequence[str]] = ()

    def __init__(self, profile: Profile) -> None:
        self.clock, self.sensor, self.stops, self.settings = VirtualClock(), PlateSensor(), 0, SETTINGS
        self.device = SimulatedDevice(Lens("MIDDLE", 14, self.sensor), profile, self.clock)
        self.connection, self._profile = FaultyDevice(self.device), profile
        self.camera = self.open()
        self.camera.capture(SETTINGS)  # an earlier shot, which a fault could bring back

    def open(self) -> Vivid900:
        """A driver over a new connection."""
        link = Link(self.connect(self.connection), None, self.clock, self.clock.sleep)
        return Vivid900(link, self._profile, calibrations(None), park=[self._stop])

    def connect(self, target: Target) -> Transport:
        """A new connection to the device: here in the same process."""
        return _Waiting(target, self.clock)

    def close(self) -> None:
        """Close the driver."""
        self.camera.close()

    def set_bus(self, faults: Mapping[int, str]) -> None:
        """Restart the count of the bus with these faults; a cable that was pulled is in again."""

    def _stop(self) -> None:
        self.stops += 1

    def inject(self, injection: Injection) -> Verdict:
        """Capture under faults, then without."""
        self.set_bus(injection.bus)
        return self.run(injection.device)

    def run(self, script: Mapping[int, Fault]) -> Verdict:
        """Capture under a script of the device's connection, then without."""
        self.connection.set_script(script)
        self.device.log.forget_past()
        self.stops, shot, start = 0, self.device.shot, self.clock()
        try:
            scan = self.camera.capture(SETTINGS)
            verdict = Verdict("scan", self.scan_violation(scan, shot))
        except ScannerError as error:
            verdict = Verdict(type(error).__name__, "" if error.hint else f"no hint: {error}")
        except Exception as error:  # an undeclared error is what this rig looks for
            verdict = Verdict("escaped", f"{type(error).__name__}: {error}")
        violation = verdict.violation or self.rest_violation(start) or self.next_capture_violation()
        return replace(verdict, violation=violation)

    def scan_violation(self, scan: RangeScan, shot: int) -> str:
        """What is false about a scan, or empty: its depth and its colour both encode the number of the shot."""
        if not scan.measured.all() or scan.texture is None:
            return "samples are missing"
        shade = int(scan.texture[0, 0, 0]) - DARKEST
        # A hundred shades, five places: the shade tells the place.
        depth = self.sensor.place_mm(shade) + LENSES["MIDDLE"].pupil_mm
        if (scan.texture != DARKEST + shade).any() or np.abs(scan.points[..., 2] + depth).max() > TRUE_MM:
            return "range and colour are of different shots"
        # A power cycle sets the count back: then the shot cannot be told by its number.
        new = {number % SHADES for number in range(shot + 1, self.device.shot + 1)}
        return "" if shade in new or self.device.shot < shot else "an earlier shot"

    def rest_violation(self, start: float) -> str:
        """What has not come to rest since start (s), or empty."""
        if self.clock() - start > MAX_SECONDS or self.connection.count > MAX_COMMANDS:
            return f"it took {self.clock() - start:.0f} s and {self.connection.count} commands"
        if not self.stops:
            return "the stage was not stopped"
        if not self.connection.connected:  # no command reaches it: the laser goes off with the end of the sweep
            self.clock.sleep(SELF_TEST_S)
        if self.device.log.laser_is_on:
            return "the laser is on"
        at_rest = not self.connection.connected or self.device.parameters.laser_power == 0
        return "" if at_rest else "the laser's power is left"

    def next_capture_violation(self) -> str:
        """What is wrong with the next capture, or empty."""
        self.connection.set_script({})
        self.set_bus({})
        shot = self.device.shot
        try:
            wrong = self.scan_violation(self.camera.capture(SETTINGS), shot)
        except ScannerError as error:
            return f"the next capture failed: {error}"
        return wrong and f"next capture: {wrong}"


class _Waiting(InProcess):
    """A transport whose time passes while an answer does not come."""

    def __init__(self, target: Target, clock: VirtualClock) -> None:
        super().__init__(target)
        self._clock = clock

    def execute(
        self, cdb: bytes, data_out: bytes = b"", data_in_length: int = 0, timeout: float = DEFAULT_TIMEOUT_S
    ) -> Reply:
        try:
            return super().execute(cdb, data_out, data_in_length, timeout)
        except NoAnswer:
            self._clock.sleep(timeout)
            raise


def count_commands(profile: Profile, rig_type: type[FaultRig] = FaultRig) -> int:
    """Commands that a capture without faults sends, coming to rest included."""
    rig = rig_type(profile)
    rig.connection.set_script({})
    rig.camera.capture(rig.settings)
    count = rig.connection.count
    rig.camera.close()
    return count


def single_faults(commands: int) -> Iterator[tuple[str, dict[int, Fault]]]:
    """Every command × every fault."""
    for (name, fault), at in product(FAULTS.items(), range(commands)):
        yield name, {at: fault}


def fault_pairs(commands: int, number: int, rng: random.Random) -> Iterator[tuple[str, dict[int, Fault]]]:
    """Two faults at two commands, sampled; the second may fall on what the first one caused."""
    names = list(FAULTS)
    for _ in range(number):
        first, second = rng.choice(names), rng.choice(names)
        at, later = sorted(rng.sample(range(commands + commands // 2), 2))
        yield f"{first} + {second}", {at: FAULTS[first], later: FAULTS[second]}


def single_injections(rig: type[FaultRig], commands: int) -> Iterator[Injection]:
    """Every command × every fault of the device, its connection and the bus."""
    for name, script in single_faults(commands):
        yield Injection(name, script)
    for name, at in product(rig.bus_faults, range(commands)):
        yield Injection(name, bus={at: name})


def pair_injections(rig: type[FaultRig], commands: int, number: int, rng: random.Random) -> Iterator[Injection]:
    """Two faults at two commands, sampled from those of the device, its connection and the bus."""
    names = [*FAULTS, *rig.bus_faults]
    for _ in range(number):
        first, second = rng.choice(names), rng.choice(names)
        places = dict(zip(sorted(rng.sample(range(commands + commands // 2), 2)), (first, second), strict=True))
        device = {at: FAULTS[name] for at, name in places.items() if name in FAULTS}
        yield Injection(f"{first} + {second}", device, {at: name for at, name in places.items() if name not in FAULTS})


def without_checksums(profile: Profile) -> Profile:
    """The profile with blocks and images that have no checksum: they are read twice."""
    blocks = {name: getattr(profile.blocks, name) for name in ("parameters", "status", "pitch", "colour")}
    bare = {name: block.model_copy(update={"checksum": None}) for name, block in blocks.items()}
    return profile.model_copy(update={"blocks": profile.blocks.model_copy(update=bare)})


def small_profile() -> Profile:
    """The simulated device's profile with larger chunks, for captures of fewer commands."""
    return load_profile(SIMULATED).model_copy(update={"chunk_bytes": CHUNK_BYTES})
