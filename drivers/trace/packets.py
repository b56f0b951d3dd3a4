"""USB transfers from the records of a capture by usbmon or USBPcap.

Sources: the Linux kernel's Documentation/usb/usbmon.rst, "Raw binary format"; the USBPcap capture format specification
(desowin.org/usbpcap/captureformat.html); the list of link types at tcpdump.org.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from drivers.trace import CaptureError

BULK = 3  # the transfer type, for usbmon and USBPcap alike
DIRECTION_IN = 0x80  # of an endpoint's address

# id, event, transfer type, endpoint, device, bus, setup flag, data flag, s, µs, status, length, captured length
_USBMON = {order: struct.Struct(order + "QcBBBHBBqiiII") for order in "<>"}
_USBMON_SHORT, _USBMON_LONG = 48, 64  # header lengths of link types 189 and 220
_SUBMITTED, _COMPLETED = b"S", b"C"
_STALLED = -32  # -EPIPE; a transfer that ends short has another code and is not a failure

# header length, request, status, function, info, bus, device, endpoint, transfer type, data length
_USBPCAP = struct.Struct("<HQIHBHHBBI")
_FROM_CONTROLLER = 0x01  # of `info`: the record is the completion

LINKTYPE_USB_LINUX, LINKTYPE_USB_LINUX_MMAPPED, LINKTYPE_USBPCAP = 189, 220, 249


@dataclass(frozen=True)
class Transfer:
    """Bulk transfer with its data: outwards when submitted, inwards when completed.

    where: bus and device address.
    inward: from the device to the host.
    data: what was captured of it; length: what was moved.
    failed: it ended with an error: mostly a halted pipe.
    """

    where: tuple[int, int]
    inward: bool
    data: bytes
    length: int
    failed: bool = False


def usbmon_transfer(record: bytes, *, header: int, order: str) -> Transfer | None:
    """Return the transfer in a record of usbmon, None for one that moves nothing.

    order: "<" or ">", that of the machine. Raises CaptureError when the record is too short.
    """
    if len(record) < header:
        raise CaptureError(f"a usbmon record of {len(record)} bytes, {header} are the least", DAMAGED)
    _, event, kind, endpoint, device, bus, _, _, _, _, status, length, captured = _USBMON[order].unpack_from(record)
    inward = bool(endpoint & DIRECTION_IN)
    if kind != BULK:
        return None
    if event != (_COMPLETED if inward else _SUBMITTED):
        return _failure((bus, device), inward) if event == _COMPLETED and status < 0 else None
    return Transfer((bus, device), inward, record[header : header + captured], length, inward and status == _STALLED)


def usbpcap_transfer(record: bytes) -> Transfer | None:
    """Return the transfer in a record of USBPcap, None for one that moves nothing.

    Raises CaptureError.
    """
    if len(record) < _USBPCAP.size:
        raise CaptureError(f"a USBPcap record of {len(record)} bytes, {_USBPCAP.size} are the least", DAMAGED)
    header, _, status, _, info, bus, device, endpoint, kind, length = _USBPCAP.unpack_from(record)
    if not _USBPCAP.size <= header <= len(record):
        raise CaptureError(f"a USBPcap header of {header} bytes in a record of {len(record)}", DAMAGED)
    inward, completed = bool(endpoint & DIRECTION_IN), bool(info & _FROM_CONTROLLER)
    if kind != BULK:
        return None
    if inward != completed:
        return _failure((bus, device), inward) if completed and status else None
    return Transfer((bus, device), inward, record[header : header + length], length, inward and status != 0)


def _failure(where: tuple[int, int], inward: bool) -> Transfer:
    return Transfer(where, inward, b"", 0, failed=True)


DAMAGED = "the capture is damaged: capture again"

READERS: Mapping[int, Callable[[bytes, str], Transfer | None]] = {
    LINKTYPE_USB_LINUX: lambda record, order: usbmon_transfer(record, header=_USBMON_SHORT, order=order),
    LINKTYPE_USB_LINUX_MMAPPED: lambda record, order: usbmon_transfer(record, header=_USBMON_LONG, order=order),
    LINKTYPE_USBPCAP: lambda record, _order: usbpcap_transfer(record),
}
"""Link type → reader of its records, given the byte order of the capturing machine."""
