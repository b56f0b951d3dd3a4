"""A real driver over a plate before a simulated device, quick enough to shoot thousands of times."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest

from drivers.scsi.in_process import InProcess
from drivers.simulated.device.clock import VirtualClock
from drivers.simulated.device.device import Lens, SimulatedDevice
from drivers.vivid900.capture.camera import Vivid900
from drivers.vivid900.connecting import calibrations
from drivers.vivid900.link import Link
from drivers.vivid900.profile.profile import SIMULATED, Profile, load_profile
from oracles.simulation.device_faults import FaultyDevice
from oracles.simulation.plate import PlateSensor

LARGE_CHUNKS = 1 << 20  # a capture of few commands


@dataclass
class Stand:
    """A device that sees a plate, fault injection in front of it, and drivers for it."""

    profile: Profile
    clock: VirtualClock = field(default_factory=VirtualClock)
    sensor: Any = field(default_factory=PlateSensor)
    serial: int = 14
    parked: list[str] = field(default_factory=list)
    known: Any = field(default_factory=lambda: calibrations(None, lens="MIDDLE"))

    def __post_init__(self) -> None:
        self.device = SimulatedDevice(Lens("MIDDLE", self.serial, self.sensor), self.profile, self.clock)
        self.faulty = FaultyDevice(self.device)

    def link(self) -> Link:
        return Link(InProcess(self.faulty), None, self.clock, self.clock.sleep)

    def camera(self, **options: Any) -> Vivid900:
        park = options.pop("park", (lambda: self.parked.append("stage"),))
        return Vivid900(self.link(), self.profile, self.known, park=park, **options)


@pytest.fixture(scope="session")
def profile() -> Profile:
    return load_profile(SIMULATED)


@pytest.fixture(scope="session")
def large_chunks(profile: Profile) -> Profile:
    return profile.model_copy(update={"chunk_bytes": LARGE_CHUNKS})


@pytest.fixture
def stand(large_chunks: Profile) -> Stand:
    return Stand(large_chunks)


@pytest.fixture(scope="session")
def make_stand(large_chunks: Profile) -> Callable[..., Stand]:
    return lambda **options: Stand(options.pop("profile", large_chunks), **options)


@pytest.fixture
def camera(stand: Stand) -> Iterator[Vivid900]:
    with stand.camera() as camera:
        yield camera
