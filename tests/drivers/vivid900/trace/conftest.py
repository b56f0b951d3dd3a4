"""A capture of the real driver as it scans with the simulated Vivid 900 through a tapped bridge."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import usb.core

from drivers.scanner import CaptureSettings
from drivers.simulated.buses.capture import TappedBridge, Urb, write_capture
from drivers.simulated.clock import VirtualClock
from drivers.simulated.device import Lens, SimulatedDevice
from drivers.vivid900.camera import Vivid900
from drivers.vivid900.connecting import calibrations
from drivers.vivid900.link import Link
from drivers.vivid900.pitch import Sums
from drivers.vivid900.profile import SIMULATED, Profile, load_profile
from drivers.vivid900.trace.packets import LINKTYPE_USB_LINUX_MMAPPED
from drivers.vivid900.transports.usb import UsbBulkOnly


class Plate:
    """A white plate that fills the picture, without optics: what matters here is how many bytes it makes."""

    distance_mm, contrast = 900.0, True

    def sweep(self, mode, distance_mm, power, gain, shot) -> Sums:
        size = (mode.rows, mode.cols)
        return Sums(np.full(size, 100, np.uint32), np.full(size, 6000, np.uint32), np.full(size, 200, np.uint8))

    def colour(self, shot):
        return np.full((480, 640, 3), 200, np.uint8)


@pytest.fixture(scope="session")
def profile() -> Profile:
    return load_profile(SIMULATED)


@pytest.fixture(scope="session")
def urbs(profile) -> list[Urb]:
    """Every transfer of connecting, one FAST shot and letting go."""
    clock = VirtualClock()
    device = SimulatedDevice(Lens("MIDDLE", 1, Plate()), profile, clock)
    bridge = TappedBridge(device)
    transport = UsbBulkOnly(usb.core.find(backend=bridge), target=5)
    link = Link(transport, None, clock, clock.sleep)
    with Vivid900(link, profile, calibrations(None)) as scanner:
        scanner.capture(CaptureSettings(mode="fast"))
    return bridge.urbs


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
