"""The records of a pcapng file (Wireshark's format), read by python-pcapng."""

from __future__ import annotations

import mmap
import struct
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pcapng import FileScanner
from pcapng.blocks import EnhancedPacket, ObsoletePacket, SimplePacket
from pcapng.exceptions import PcapngException

from drivers.trace import CaptureError
from drivers.trace.packets import DAMAGED, READERS, Transfer

PCAPNG_START = bytes.fromhex("0a0d0d0a")
PCAP_STARTS = {bytes.fromhex(start) for start in ("a1b2c3d4", "d4c3b2a1", "a1b23c4d", "4d3cb2a1")}
PACKETS = (EnhancedPacket, SimplePacket, ObsoletePacket)


def read_transfers(path: Path) -> Iterator[Transfer]:
    """The bulk transfers of a capture in their order. Raises CaptureError."""
    with _mapped(path) as content:
        if content[:4] in PCAP_STARTS:
            hint = f"convert it: editcap -F pcapng {path} {path.with_suffix('.pcapng')}"
            raise CaptureError(f"{path} is a pcap file of the old kind", hint)
        if content[:4] != PCAPNG_START:
            raise CaptureError(f"{path} is not a pcapng file", "save the capture as pcapng, Wireshark's own format")
        yield from _usb_only(path, content)


@contextmanager
def _mapped(path: Path) -> Iterator[mmap.mmap]:
    """Map the file to memory.

    Reading beyond its end returns what exists, for any length that a damaged file claims.
    """
    try:
        if not path.is_file():
            raise CaptureError(f"cannot read {path}: it is not a file", "check the path")
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            yield content
    except OSError as error:
        raise CaptureError(f"cannot read {path}: {error.strerror}", "check the path") from error
    except ValueError as error:  # what cannot be mapped: an empty file
        raise CaptureError(f"{path} is empty", "capture again") from error


def _usb_only(path: Path, content: mmap.mmap) -> Iterator[Transfer]:
    unread: set[int] = set()
    found = False
    for link_type, order, record in _records(path, content):
        reader = READERS.get(link_type)
        if reader is None:
            unread.add(link_type)
        elif transfer := reader(record, order):
            found = True
            yield transfer
    if not found:
        others = f" (it has link types {', '.join(map(str, sorted(unread)))})" if unread else ""
        hint = "capture from usbmon or USBPcap while the vendor's program scans"
        raise CaptureError(f"{path} has no USB bulk transfers{others}", hint)


def _records(path: Path, content: Any) -> Iterator[tuple[int, str, bytes]]:
    """Link type, byte order and bytes of every record."""
    blocks = iter(FileScanner(content))
    while True:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", DeprecationWarning)  # the library's own use of its option types
                block = next(blocks, None)
            if block is None:
                return
            if not isinstance(block, PACKETS):
                continue
            record = block.interface.link_type, block.section.endianness, bytes(block.packet_data)
        # Besides its own errors the library lets several of Python's through when a block is damaged.
        except (PcapngException, ArithmeticError, AssertionError, AttributeError, LookupError, RuntimeError) as error:
            raise _damaged(path, error) from error
        except (TypeError, ValueError, OverflowError, OSError, struct.error) as error:
            raise _damaged(path, error) from error
        yield record


def _damaged(path: Path, error: Exception) -> CaptureError:
    return CaptureError(f"{path} is damaged: {error}", DAMAGED)
