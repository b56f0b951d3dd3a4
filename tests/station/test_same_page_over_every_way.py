"""One page, scanned with the real driver over every way to the simulated device: the same to the byte."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
import usb.core

from drivers.scsi.in_process import InProcess
from drivers.scsi.replay import Recorder, load_replay
from drivers.scsi.transport import Transport
from drivers.scsi.usb import UsbBulkOnly
from drivers.simulated.device.clock import VirtualClock
from drivers.simulated.device.device import Lens, SimulatedDevice
from drivers.simulated.scanner import rig
from drivers.vivid900.capture.camera import Vivid900
from drivers.vivid900.connecting import calibrations
from drivers.vivid900.link import Link
from drivers.vivid900.profile.profile import SIMULATED, load_profile
from drivers.vivid900.settings import VividSettings
from oracles.simulation.buses.sg_node import SimulatedSgNode
from oracles.simulation.buses.usb_bridge import SimulatedBridge
from restore import RangeScan, Settings, restore
from station.images.png import encode_png

SHOT = VividSettings(mode="fast", distance_mm=900.0, laser_power=60, gain=0)  # one shot, without a preview
COARSE = Settings(points=100, dpi=40)
NOON = datetime(2025, 1, 1, 12, tzinfo=UTC)

ENOUGH = 10_000  # samples of the page: there is something to be the same

Way = Callable[[SimulatedDevice, Path], AbstractContextManager[Transport]]


@contextmanager
def in_process(device: SimulatedDevice, folder: Path) -> Iterator[Transport]:
    yield InProcess(device)


@contextmanager
def sg_io(device: SimulatedDevice, folder: Path) -> Iterator[Transport]:
    """Recorded on the way, for the replay."""
    node = SimulatedSgNode(device).connect()
    with (folder / "talk.jsonl").open("w") as file:
        yield Recorder(node, file)


@contextmanager
def bulk_only(device: SimulatedDevice, folder: Path) -> Iterator[Transport]:
    yield UsbBulkOnly(usb.core.find(backend=SimulatedBridge(device)), target=5)


@contextmanager
def replay(device: SimulatedDevice, folder: Path) -> Iterator[Transport]:
    yield load_replay(folder / "talk.jsonl")
    assert device.shot == 0  # nobody asked it


def scan_over(way: Way, lens: Lens, folder: Path) -> RangeScan:
    """A scanner of its own for each way, before the same page."""
    clock = VirtualClock()
    device = SimulatedDevice(lens, load_profile(SIMULATED), clock)
    with way(device, folder) as transport:
        link = Link(transport, None, clock, clock.sleep)
        with Vivid900(link, device.profile, calibrations(None), now=lambda: NOON) as scanner:
            scan = scanner.capture(SHOT)
    assert device.is_parked
    return scan


def page_of(scan: RangeScan) -> bytes:
    page = restore(scan, COARSE)
    return encode_png(page.image, page.dpi)


@pytest.mark.slow
def test_the_page_is_the_same_to_the_byte(repository, tmp_path):
    table = tomllib.loads((repository / "configs/simulated.toml").read_text("utf-8"))["scanner"]
    lens = rig(table).device.lens
    first = scan_over(in_process, lens, tmp_path)
    assert np.isfinite(first.points).all(axis=2).sum() > ENOUGH
    page = page_of(first)
    for way in (sg_io, bulk_only, replay):
        scan = scan_over(way, lens, tmp_path)
        for name in ("points", "texture", "texture_xy"):
            assert getattr(scan, name).tobytes() == getattr(first, name).tobytes(), f"{name} over {way.__name__}"
        assert scan.provenance == first.provenance
        assert page_of(scan) == page, way.__name__
