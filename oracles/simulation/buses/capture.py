"""Captures the traffic of a simulated bridge as Wireshark would: usbmon or USBPcap records in a pcapng file."""

from __future__ import annotations

import errno
import struct
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import IO, Any

import usb.core
from pcapng import FileWriter
from pcapng.blocks import EnhancedPacket, InterfaceDescription, SectionHeader

from drivers.trace.packets import BULK, LINKTYPE_USB_LINUX, LINKTYPE_USB_LINUX_MMAPPED, LINKTYPE_USBPCAP
from oracles.simulation.buses.usb_bridge import SimulatedBridge
from oracles.simulation.buses.usb_descriptors import BULK_IN

BUS, DEVICE = 1, 5
IN_PROGRESS = -115  # -EINPROGRESS: the status of a submission
STALL_PID = 0xC0000004  # USBD_STATUS of a halted pipe


@dataclass(frozen=True)
class Urb:
    """A transfer as the host sees it. error: negative errno, 0 when it went well."""

    endpoint: int
    data: bytes
    asked: int
    error: int = 0

    @property
    def inward(self) -> bool:
        return self.endpoint == BULK_IN


class TappedBridge(SimulatedBridge):
    """A simulated bridge that notes every bulk transfer in `urbs`."""

    urbs: list[Urb]

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.urbs = []

    def bulk_write(self, handle: Any, endpoint: int, interface: int, data: array[int], timeout: int) -> int:
        error = 0
        try:
            return super().bulk_write(handle, endpoint, interface, data, timeout)
        except usb.core.USBError as fault:
            error = -(fault.errno or 0)
            raise
        finally:
            self.urbs.append(Urb(endpoint, data.tobytes(), len(data), error))

    def bulk_read(self, handle: Any, endpoint: int, interface: int, buffer: array[int], timeout: int) -> int:
        came, error = 0, 0
        try:
            came = super().bulk_read(handle, endpoint, interface, buffer, timeout)
        except usb.core.USBError as fault:
            error = -(fault.errno or 0)
            raise
        finally:
            self.urbs.append(Urb(endpoint, buffer[:came].tobytes(), len(buffer), error))
        return came


def write_capture(file: IO[bytes], urbs: Iterable[Urb], *, link_type: int = LINKTYPE_USB_LINUX_MMAPPED) -> None:
    """Write a pcapng file with one interface. link_type: usbmon's 189 or 220, or USBPcap's 249."""
    section = SectionHeader(endianness="<")
    section.new_member(InterfaceDescription, link_type=link_type, snaplen=0)
    writer = FileWriter(file, section)
    for number, urb in enumerate(urbs):
        for record in RECORDS[link_type](number, urb):
            packet = {"packet_data": record, "packet_len": len(record), "interface_id": 0}
            writer.write_block(section.new_member(EnhancedPacket, **packet))


def _usbmon(number: int, urb: Urb, *, padding: int) -> Iterator[bytes]:
    """Submission and completion. Data goes with the one that moves it."""
    for event, status in ((b"S", IN_PROGRESS), (b"C", urb.error)):
        data = urb.data if urb.inward == (event == b"C") else b""
        length = urb.asked if event == b"S" else len(urb.data)
        yield struct.pack(
            "<QcBBBHBBqiiII8s",
            number, event, BULK, urb.endpoint, DEVICE, BUS, ord("-"), 0 if data else ord("<"), number, 0, status,
            length, len(data), bytes(8),
        ) + bytes(padding) + data  # fmt: skip


def _usbpcap(number: int, urb: Urb) -> Iterator[bytes]:
    for completed in (False, True):
        data = urb.data if urb.inward == completed else b""
        status = STALL_PID if completed and urb.error == -errno.EPIPE else 0
        yield struct.pack(
            "<HQIHBHHBBI", 27, number, status, 0x09, completed, BUS, DEVICE, urb.endpoint, BULK, len(data)
        ) + data  # fmt: skip


RECORDS: Mapping[int, Callable[[int, Urb], Iterator[bytes]]] = {
    LINKTYPE_USB_LINUX: lambda number, urb: _usbmon(number, urb, padding=0),
    LINKTYPE_USB_LINUX_MMAPPED: lambda number, urb: _usbmon(number, urb, padding=16),
    LINKTYPE_USBPCAP: _usbpcap,
}
