"""Captures written with `struct` alone, from the specifications: nothing here is shared with the reader under test.

pcapng: IETF draft-ietf-opsawg-pcapng, sections 4.1 to 4.3. USB records: the kernel's usbmon.rst (link type 220) and the
USBPcap capture format (249). Wrappers: USB Mass Storage Bulk-Only Transport 1.0, sections 5.1 and 5.2.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

BUS, DEVICE, OUT, IN = 3, 9, 0x02, 0x81
PIECE = 20_000  # bytes of a transfer: a virtual machine's controller cuts them
Option = tuple[int, bytes]


@dataclass(frozen=True)
class Said:
    """A command, its data, and its SCSI status."""

    cdb: bytes
    sent: bytes = b""
    came: bytes = b""
    asked: int = 0
    status: int = 0


@dataclass
class Listener:
    """A device that notes what is said to it. Sense data are asked for separately, as over USB."""

    device: object
    said: list[Said] = field(default_factory=list)

    def execute(self, cdb: bytes, data_out: bytes, data_in_length: int):
        reply = self.device.execute(cdb, data_out, data_in_length)
        self.said.append(Said(cdb, data_out, reply.data, data_in_length, reply.status))
        return reply


def transfers(said: Iterable[Said]) -> Iterator[tuple[int, bytes]]:
    """Endpoint and bytes of every bulk transfer: command wrapper, data in pieces, status wrapper."""
    for tag, one in enumerate(said, start=7):
        length, flags = (len(one.sent), 0) if one.sent else (one.asked, 0x80)
        yield OUT, struct.pack("<4sIIBBB16s", b"USBC", tag, length, flags, 0x50, len(one.cdb), one.cdb)
        data, endpoint = (one.sent, OUT) if one.sent else (one.came, IN)
        for start in range(0, len(data), PIECE):
            yield endpoint, data[start : start + PIECE]
        yield IN, struct.pack("<4sIIB", b"USBS", tag, length - len(data), 1 if one.status else 0)


def usbmon(said: Iterable[Said]) -> Iterator[bytes]:
    for number, (endpoint, data) in enumerate(transfers(said)):
        for event in (b"S", b"C"):
            carries = (event == b"C") == bool(endpoint & 0x80)
            yield struct.pack(
                "<Q1sBBBHBBqiiII8siiII",
                0xFFFF0000 + number, event, 3, endpoint, DEVICE, BUS, 0x2D, 0 if carries else 0x3C, 1700000000, number,
                -115 if event == b"S" else 0, len(data), len(data) if carries else 0, bytes(8), 0, 0, 0, 0,
            ) + (data if carries else b"")  # fmt: skip


def usbpcap(said: Iterable[Said]) -> Iterator[bytes]:
    for number, (endpoint, data) in enumerate(transfers(said)):
        for completed in (0, 1):
            carries = bool(completed) == bool(endpoint & 0x80)
            kept = data if carries else b""
            yield struct.pack("<HQIHBHHBBI", 27, number, 0, 9, completed, BUS, DEVICE, endpoint, 3, len(kept)) + kept


RECORDS: dict[int, Callable[[Iterable[Said]], Iterator[bytes]]] = {220: usbmon, 249: usbpcap}


def write(path: Path, said: Iterable[Said], link_type: int = 249, *, options: Iterable[Option] = ()) -> Path:
    """A pcapng file. options: of the interface, each its code and its bytes, whatever they are."""
    packed = b"".join(struct.pack("<HH", code, len(value)) + padded(value) for code, value in options)
    blocks = [
        block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1)),
        block(1, struct.pack("<HHI", link_type, 0, 0) + packed),
    ]
    for number, record in enumerate(RECORDS[link_type](said)):
        head = struct.pack("<IIIII", 0, number >> 32, number & 0xFFFFFFFF, len(record), len(record))
        blocks.append(block(6, head + padded(record)))
    path.write_bytes(b"".join(blocks))
    return path


def block(kind: int, body: bytes) -> bytes:
    length = 12 + len(body)
    return struct.pack("<II", kind, length) + body + struct.pack("<I", length)


def padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)
