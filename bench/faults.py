"""`python -m bench.faults`: every command of a capture × every fault, and a sample of pairs, over the real driver.

What must hold: the capture gives the true scan or raises a declared error, in bounded time and commands; the device
comes to rest; the next capture gives the true scan.
"""

from __future__ import annotations

import random
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from time import perf_counter

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
MOST_SECONDS, MOST_COMMANDS = 300.0, 2000
PAIRS, SEED = 400, 1


@dataclass(frozen=True)
class Verdict:
    """What came of one capture under faults: "scan" or the name of the error; `wrong` says what must not be, if so."""

    outcome: str
    wrong: str = ""


class Stand:
    """A simulated device with a plate before it, a faulty way to it, and the real driver over them."""

    def __init__(self, profile: Profile, connect: Callable[[Target], Transport] = InProcess) -> None:
        self.clock, self.sensor, self.stops, self.settings = VirtualClock(), PlateSensor(), 0, SETTINGS
        self.device = SimulatedDevice(Lens("MIDDLE", 14, self.sensor), profile, self.clock)
        self.way = FaultyDevice(self.device)
        link = Link(connect(self.way), None, self.clock, self.clock.sleep)
        self.camera = Vivid900(link, profile, calibrations(None), park=[self._stop])
        self.camera.capture(SETTINGS)  # so that there is an earlier shot to be confused with

    def _stop(self) -> None:
        self.stops += 1

    def run(self, script: Mapping[int, Fault]) -> Verdict:
        """Capture under a script, then without."""
        self.way.set_script(script)
        self.stops, shot, start = 0, self.device.shot, self.clock()
        try:
            scan = self.camera.capture(SETTINGS)
            verdict = Verdict("scan", self.wrong(scan, shot))
        except ScannerError as error:
            verdict = Verdict(type(error).__name__, "" if error.hint else f"no hint: {error}")
        except Exception as error:  # anything else is what this looks for
            verdict = Verdict("escaped", f"{type(error).__name__}: {error}")
        return replace(verdict, wrong=verdict.wrong or self.unrest(start) or self._unusable())

    def wrong(self, scan: RangeScan, shot: int) -> str:
        """What is not true about a scan: its depth and its colour tell of which shot they are."""
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

    def unrest(self, start: float) -> str:
        """What has not come to rest."""
        if self.clock() - start > MOST_SECONDS or self.way.count > MOST_COMMANDS:
            return f"it took {self.clock() - start:.0f} s and {self.way.count} commands"
        if not self.stops:
            return "the stage was not stopped"
        if not self.way.connected:  # nobody can tell it anything: the laser goes out with the end of the sweep
            self.clock.sleep(SELF_TEST_S)
        if self.device.log.laser_is_on:
            return "the laser is on"
        return "" if not self.way.connected or self.device.parameters.laser_power == 0 else "the laser's power is left"

    def _unusable(self) -> str:
        """What is wrong with the next capture."""
        self.way.set_script({})
        shot = self.device.shot
        try:
            wrong = self.wrong(self.camera.capture(SETTINGS), shot)
        except ScannerError as error:
            return f"the next capture failed: {error}"
        return wrong and f"next capture: {wrong}"


def length_of_capture(profile: Profile) -> int:
    """Commands that a capture without faults sends, coming to rest included."""
    stand = Stand(profile)
    stand.run({})
    stand.way.set_script({})
    stand.camera.capture(stand.settings)
    return stand.way.count


def singles(commands: int) -> Iterator[tuple[str, dict[int, Fault]]]:
    """Every command × every fault."""
    for (name, fault), at in product(FAULTS.items(), range(commands)):
        yield name, {at: fault}


def pairs(commands: int, number: int, rng: random.Random) -> Iterator[tuple[str, dict[int, Fault]]]:
    """Two faults at two commands, sampled; the second may fall on what the first one caused."""
    names = list(FAULTS)
    for _ in range(number):
        first, second = rng.choice(names), rng.choice(names)
        at, later = sorted(rng.sample(range(commands + commands // 2), 2))
        yield f"{first} + {second}", {at: FAULTS[first], later: FAULTS[second]}


def small_profile() -> Profile:
    """The simulated device's profile with larger chunks, for captures of fewer commands."""
    return load_profile(SIMULATED).model_copy(update={"chunk_bytes": CHUNK_BYTES})


def main() -> int:
    """Print what came of each fault, then the counts. Returns 1 when anything was wrong."""
    profile, start = small_profile(), perf_counter()
    commands = length_of_capture(profile)
    stand, bad, table = Stand(profile), list[str](), dict[str, Counter[str]]()
    for name, script in singles(commands):
        verdict = stand.run(script)
        table.setdefault(name, Counter())[verdict.outcome] += 1
        bad += [f"{name} at command {min(script)}: {verdict.wrong}"] if verdict.wrong else []
    print(f"one fault: {commands} commands × {len(FAULTS)} faults = {commands * len(FAULTS)} captures")
    for name, outcomes in table.items():
        print(f"  {name:<22}", ", ".join(f"{outcome} {count}" for outcome, count in outcomes.most_common()))
    both = Counter[str]()
    for name, script in pairs(commands, PAIRS, random.Random(SEED)):
        verdict = stand.run(script)
        both[verdict.outcome] += 1
        bad += [f"{name} at commands {sorted(script)}: {verdict.wrong}"] if verdict.wrong else []
    print(f"two faults: {PAIRS} captures:", ", ".join(f"{outcome} {count}" for outcome, count in both.most_common()))
    print(f"wrong: {len(bad)}; {perf_counter() - start:.0f} s", *bad, sep="\n  ")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
