"""The real driver and its transports over simulated buses that fail by a script: USB Bulk-Only and SG_IO."""

from __future__ import annotations

from collections.abc import Mapping

import usb.core

from drivers.scsi.transport import Target, Transport
from drivers.scsi.usb import UsbBulkOnly
from oracles.faults import CHUNK_BYTES, FaultRig
from oracles.simulation.buses import bulk_only_device, sg_node
from oracles.simulation.buses.sg_node import SimulatedSgNode
from oracles.simulation.buses.usb_bridge import SimulatedBridge
from oracles.simulation.buses.usb_descriptors import HIGH_SPEED


class UsbRig(FaultRig):
    """The fault rig with a USB bridge between driver and device. It stays when the driver connects anew."""

    bus_faults = bulk_only_device.FAULTS
    bridge: SimulatedBridge | None = None

    def connect(self, target: Target) -> Transport:
        if self.bridge is None:
            self.bridge = self.make_bridge(target)
        return UsbBulkOnly(usb.core.find(backend=self.bridge), target=5, max_transfer=CHUNK_BYTES, clock=self.clock)

    def make_bridge(self, target: Target) -> SimulatedBridge:
        """The bridge before the device."""
        return SimulatedBridge(target, packet_size=HIGH_SPEED, sleep=self.clock.sleep)

    def set_bus(self, faults: Mapping[int, str]) -> None:
        assert self.bridge is not None
        self.bridge.device.wrappers.clear()
        self.bridge.device.faults = dict(faults)
        if self.bridge.device.unplugged:
            self.bridge.plug()

    def rest_violation(self, start: float) -> str:
        assert self.bridge is not None
        self.connection.connected &= not self.bridge.device.unplugged
        return super().rest_violation(start)


class SgRig(FaultRig):
    """The fault rig with the kernel's generic SCSI driver between driver and device."""

    bus_faults = tuple(sg_node.FAULTS)
    node: SimulatedSgNode | None = None

    def connect(self, target: Target) -> Transport:
        if self.node is None:
            self.node = self.make_node(target)
        return self.node.connect(max_transfer=CHUNK_BYTES)

    def make_node(self, target: Target) -> SimulatedSgNode:
        """The node of the device."""
        return SimulatedSgNode(target, sleep=self.clock.sleep)

    def set_bus(self, faults: Mapping[int, str]) -> None:
        assert self.node is not None
        self.node.commands = 0
        self.node.faults = {at: sg_node.FAULTS[name] for at, name in faults.items()}


RIGS: dict[str, type[FaultRig]] = {"in-process": FaultRig, "sg": SgRig, "usb": UsbRig}
"""Transport → rig."""
