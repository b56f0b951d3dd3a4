"""`python -m bench.bus_faults`: every command of a capture × every fault of the USB bus, below the real transport.

What must hold is what `bench.faults` asks for; only that the faults are those of Bulk-Only: halts, phase errors, lost,
damaged and doubled status wrappers, data too short and too long, silence, a pulled plug.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Mapping
from itertools import product
from time import perf_counter

import usb.core

from bench.faults import CHUNK_BYTES, SETTINGS, Stand, Verdict, small_profile
from drivers.simulated.buses.bulk_only_device import FAULTS
from drivers.simulated.buses.usb_bridge import SimulatedBridge
from drivers.simulated.buses.usb_descriptors import HIGH_SPEED
from drivers.vivid900.profile import Profile
from drivers.vivid900.transports import Target, Transport
from drivers.vivid900.transports.usb import UsbBulkOnly


class BridgedStand(Stand):
    """The same stand with a USB bridge between driver and device."""

    def __init__(self, profile: Profile) -> None:
        super().__init__(profile, self._bridged)

    def _bridged(self, target: Target) -> Transport:
        self.bridge = SimulatedBridge(target, packet_size=HIGH_SPEED)
        return UsbBulkOnly(usb.core.find(backend=self.bridge), target=5, max_transfer=CHUNK_BYTES)

    def run_bus(self, faults: Mapping[int, str]) -> Verdict:
        """Capture while the bus goes wrong at some commands, then without."""
        self.bridge.device.wrappers.clear()
        self.bridge.device.faults = dict(faults)
        return self.run({})

    def unrest(self, start: float) -> str:
        self.way.connected = not self.bridge.device.unplugged
        return super().unrest(start)

    def _unusable(self) -> str:
        self.bridge.device.faults = {}
        self.bridge.plug()
        return super()._unusable()


def length_of_capture(profile: Profile) -> int:
    """Commands that a capture without faults sends over the bus, coming to rest included."""
    stand = BridgedStand(profile)
    stand.bridge.device.wrappers.clear()
    stand.camera.capture(SETTINGS)
    return len(stand.bridge.device.wrappers)


def main() -> int:
    """Print what came of each fault, then the count. Returns 1 when anything was wrong."""
    profile, start = small_profile(), perf_counter()
    commands = length_of_capture(profile)
    stand, bad, table = BridgedStand(profile), list[str](), dict[str, Counter[str]]()
    for fault, at in product(FAULTS, range(commands)):
        verdict = stand.run_bus({at: fault})
        table.setdefault(fault, Counter())[verdict.outcome] += 1
        bad += [f"{fault} at command {at}: {verdict.wrong}"] if verdict.wrong else []
    print(f"one fault: {commands} commands × {len(FAULTS)} faults = {commands * len(FAULTS)} captures")
    for fault, outcomes in table.items():
        print(f"  {fault:<24}", ", ".join(f"{outcome} {count}" for outcome, count in outcomes.most_common()))
    print(f"wrong: {len(bad)}; {perf_counter() - start:.0f} s", *bad, sep="\n  ")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
