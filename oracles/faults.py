"""The real driver over a simulated device whose answers fail by a script, and what must hold after every capture.

The capture gives the true scan or raises a declared error, in bounded time and commands; the device comes to rest; the
next capture gives the true scan.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from drivers.scanner import CaptureSettings, ScannerError
from drivers.simulated.clock import VirtualClock
from drivers.simulated.device import SELF_TEST_S, Lens, SimulatedDevice
from drivers.simulated.faults import FAULTS, Fault, FaultyDevice
from drivers.simulated.plate import DARKEST, SHADES, PlateSensor
from drivers.vivid900.camera import Vivid900
from drivers.vivid900.connecting import calibrations
from drivers.vivid900.lenses import LENSES
from drivers.vivid900.link import Link
from drivers.vivid900.profile import SIMULATED, Profile, load_profile
from drivers.vivid900.transports import Target, Transport
from drivers.vivid900.transports.in_process import InProcess
from restore.scan import RangeScan

SETTINGS = CaptureSettings(mode="fast", laser_power=68, gain=0)  # autofocus, one shot, the range image and the colours
CHUNK_BYTES = 400_000  # two commands for the range image, three for the colours: first, middle and last behave alike
TRUE_MM = 0.01  # what rounding of the sums leaves of the plate's depth
# Three attempts and coming to rest, each with its longest waits.
MAX_SECONDS, MAX_COMMANDS = 300.0, 2000


@dataclass(frozen=True)
class Verdict:
    """The outcome of one capture under faults, "scan" or the name of the error, and the rule it broke, or empty."""

    outcome: str
    violation: str = ""


class FaultRig:
    """A simulated device with a plate before it, a faulty connection to it, and the real driver over them."""

    def __init__(self, profile: Profile, connect: Callable[[Target], Transport] = InProcess) -> None:
        self.clock, self.sensor, self.stops, self.settings = VirtualClock(), PlateSensor(), 0, SETTINGS
        self.device = SimulatedDevice(Lens("MIDDLE", 14, self.sensor), profile, self.clock)
        self.connection = FaultyDevice(self.device)
        link = Link(connect(self.connection), None, self.clock, self.clock.sleep)
        self.camera = Vivid900(link, profile, calibrations(None), park=[self._stop])
        self.camera.capture(SETTINGS)  # an earlier shot, which a fault could bring back

    def _stop(self) -> None:
        self.stops += 1

    def run(self, script: Mapping[int, Fault]) -> Verdict:
        """Capture under a script, then without."""
        self.connection.set_script(script)
        self.stops, shot, start = 0, self.device.shot, self.clock()
        try:
            scan = self.camera.capture(SETTINGS)
            verdict = Verdict("scan", self.scan_violation(scan, shot))
        except ScannerError as error:
            verdict = Verdict(type(error).__name__, "" if error.hint else f"no hint: {error}")
        except Exception as error:  # an undeclared error is what this rig looks for
            verdict = Verdict("escaped", f"{type(error).__name__}: {error}")
        violation = verdict.violation or self.rest_violation(start) or self._next_capture_violation()
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

    def _next_capture_violation(self) -> str:
        """What is wrong with the next capture, or empty."""
        self.connection.set_script({})
        shot = self.device.shot
        try:
            wrong = self.scan_violation(self.camera.capture(SETTINGS), shot)
        except ScannerError as error:
            return f"the next capture failed: {error}"
        return wrong and f"next capture: {wrong}"


def count_commands(profile: Profile) -> int:
    """Commands that a capture without faults sends, coming to rest included."""
    rig = FaultRig(profile)
    rig.run({})
    rig.connection.set_script({})
    rig.camera.capture(rig.settings)
    return rig.connection.count


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


def small_profile() -> Profile:
    """The simulated device's profile with larger chunks, for captures of fewer commands."""
    return load_profile(SIMULATED).model_copy(update={"chunk_bytes": CHUNK_BYTES})
