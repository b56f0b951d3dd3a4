"""The real driver and its USB transport over a simulated bus that fails by a script."""

from __future__ import annotations

from collections.abc import Mapping

import usb.core

from drivers.simulated.buses.usb_bridge import SimulatedBridge
from drivers.simulated.buses.usb_descriptors import HIGH_SPEED
from drivers.vivid900.profile import Profile
from drivers.vivid900.transports import Target, Transport
from drivers.vivid900.transports.usb import UsbBulkOnly
from oracles.faults import CHUNK_BYTES, SETTINGS, FaultRig, Verdict


class BusFaultRig(FaultRig):
    """The fault rig with a USB bridge between driver and device."""

    def __init__(self, profile: Profile) -> None:
        super().__init__(profile, self._bridged)

    def _bridged(self, target: Target) -> Transport:
        self.bridge = SimulatedBridge(target, packet_size=HIGH_SPEED)
        return UsbBulkOnly(usb.core.find(backend=self.bridge), target=5, max_transfer=CHUNK_BYTES)

    def run_bus(self, faults: Mapping[int, str]) -> Verdict:
        """Capture under faults of the bus, command number → fault, then capture without."""
        self.bridge.device.wrappers.clear()
        self.bridge.device.faults = dict(faults)
        return self.run({})

    def rest_violation(self, start: float) -> str:
        self.connection.connected = not self.bridge.device.unplugged
        return super().rest_violation(start)

    def _next_capture_violation(self) -> str:
        self.bridge.device.faults = {}
        self.bridge.plug()
        return super()._next_capture_violation()


def count_commands(profile: Profile) -> int:
    """Commands that a capture without faults sends over the bus, coming to rest included."""
    rig = BusFaultRig(profile)
    rig.bridge.device.wrappers.clear()
    rig.camera.capture(SETTINGS)
    return len(rig.bridge.device.wrappers)
