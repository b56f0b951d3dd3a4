"""A capture of the real driver as it scans with the simulated Vivid 900 through a tapped bridge."""

from __future__ import annotations

from pathlib import Path

import pytest
import usb.core

from drivers.scsi.usb import UsbBulkOnly
from drivers.simulated.device.clock import VirtualClock
from drivers.simulated.device.device import Lens, SimulatedDevice
from drivers.trace.packets import LINKTYPE_USB_LINUX_MMAPPED
from drivers.vivid900.capture.camera import Vivid900
from drivers.vivid900.connecting import calibrations
from drivers.vivid900.link import Link
from drivers.vivid900.profile.profile import SIMULATED, Profile, load_profile
from drivers.vivid900.settings import VividSettings
from oracles.simulation.buses.capture import TappedBridge, Urb, write_capture
from oracles.simulation.buses.usb_bridge import SimulatedBridge
from oracles.simulation.plate import PlateSensor
from restore.scan import RangeScan


@pytest.fixture(scope="session")
def profile() -> Profile:
    return load_profile(SIMULATED)


def scan_through(bridge_kind, profile: Profile, settings: VividSettings) -> tuple[RangeScan, SimulatedBridge]:
    clock = VirtualClock()
    bridge = bridge_kind(SimulatedDevice(Lens("MIDDLE", 1, PlateSensor()), load_profile(SIMULATED), clock))
    transport = UsbBulkOnly(usb.core.find(backend=bridge), target=5)
    with Vivid900(Link(transport, None, clock, clock.sleep), profile, calibrations(None)) as scanner:
        return scanner.capture(settings), bridge


@pytest.fixture(scope="session")
def urbs(profile) -> list[Urb]:
    """Every transfer of connecting, one FAST shot and letting go."""
    return scan_through(TappedBridge, profile, VividSettings(mode="fast"))[1].urbs


@pytest.fixture(scope="session")
def scan_with():
    """Scan with a profile of one's own."""
    return lambda profile, settings: scan_through(SimulatedBridge, profile, settings)[0]


@pytest.fixture(scope="session")
def captured(urbs, tmp_path_factory):
    """Write a capture in the format of a link type; the file is made once."""
    folder, files = tmp_path_factory.mktemp("captures"), {}

    def captured(link_type: int = LINKTYPE_USB_LINUX_MMAPPED) -> Path:
        if link_type not in files:
            files[link_type] = folder / f"{link_type}.pcapng"
            with files[link_type].open("wb") as file:
                write_capture(file, urbs, link_type=link_type)
        return files[link_type]

    return captured
