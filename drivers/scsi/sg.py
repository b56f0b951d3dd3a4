"""A SCSI device behind Linux's generic driver: /dev/sg* and its ioctl SG_IO.

Source: the kernel's include/scsi/sg.h (version 3 of the interface) and the SCSI Generic HOWTO.
"""

from __future__ import annotations

import ctypes
import errno
import fcntl
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from drivers.scanner import TransportError
from drivers.scsi.checks import SAFE_TRANSFER, check_command, with_sense
from drivers.scsi.ownership import in_use, lock_node
from drivers.scsi.transport import CHECK_CONDITION, DEFAULT_TIMEOUT_S, GOOD, Reply

SG_IO = 0x2285
SCSI_GENERIC = ord("S")
NO_DATA, TO_DEVICE, FROM_DEVICE = -1, -2, -3
SENSE_BUFFER_LENGTH = 64  # bytes: more than fixed-format sense data, and it fits the length's one byte
STATUS_MASK = 0x3E  # the other bits of a SCSI-2 status byte are reserved
DRIVER_SENSE, DRIVER_MASK = 0x08, 0x0F  # set by older kernels only because there is sense data

Ioctl = Callable[[int, int, Any], int]


class SgIoHeader(ctypes.Structure):
    """`sg_io_hdr_t`: one command and its result. 88 bytes with 8-byte pointers."""

    _fields_ = (
        ("interface_id", ctypes.c_int),
        ("dxfer_direction", ctypes.c_int),
        ("cmd_len", ctypes.c_ubyte),
        ("mx_sb_len", ctypes.c_ubyte),
        ("iovec_count", ctypes.c_ushort),
        ("dxfer_len", ctypes.c_uint),
        ("dxferp", ctypes.c_void_p),
        ("cmdp", ctypes.c_void_p),
        ("sbp", ctypes.c_void_p),
        ("timeout", ctypes.c_uint),
        ("flags", ctypes.c_uint),
        ("pack_id", ctypes.c_int),
        ("usr_ptr", ctypes.c_void_p),
        ("status", ctypes.c_ubyte),
        ("masked_status", ctypes.c_ubyte),
        ("msg_status", ctypes.c_ubyte),
        ("sb_len_wr", ctypes.c_ubyte),
        ("host_status", ctypes.c_ushort),
        ("driver_status", ctypes.c_ushort),
        ("resid", ctypes.c_int),
        ("duration", ctypes.c_uint),
        ("info", ctypes.c_uint),
    )


HOST_FAULTS = {  # the kernel's DID_* codes (include/scsi/scsi_status.h) → message, hint
    0x01: ("no device answers at this SCSI ID", "check the scanner's power, cable and SCSI ID, then rescan the bus"),
    0x02: ("the SCSI bus stayed busy", "check the cable and both ends' termination"),
    0x03: ("the scanner did not answer in time", "check the cable; switch the scanner off, wait 5 s, and on again"),
    0x04: ("this SCSI ID is not on the bus", "look for the scanner with: planish devices"),
    0x05: ("the command was aborted", "try again"),
    0x06: ("parity error on the SCSI bus", "check the cable and both ends' termination"),
    0x07: ("the SCSI card or bridge reports a fault of its own", "check the cable, then try again"),
    0x08: ("the SCSI bus was reset", "try again"),
}
OPEN_HINTS = {
    errno.EACCES: "you may not use this device: planish doctor shows the udev rule to add",
    errno.EPERM: "you may not use this device: planish doctor shows the udev rule to add",
    errno.ENOENT: "look for the scanner with: planish devices",
    errno.ENODEV: "the scanner has gone: check its power and cable, then rescan the bus",
    errno.ENXIO: "the scanner has gone: check its power and cable, then rescan the bus",
}


class SgDevice:
    """Device at /dev/sg*, for this process alone.

    O_EXCL excludes every other program (SCSI Generic HOWTO §7.1), and a lock names the holder to them.
    Raises TransportError when it cannot be opened.
    """

    def __init__(
        self,
        path: Path,
        *,
        max_transfer: int = SAFE_TRANSFER,
        ioctl: Ioctl = fcntl.ioctl,
        open_node: Callable[[Path, int], int] = os.open,
    ) -> None:
        self.max_transfer = max_transfer
        self._path, self._ioctl = path, ioctl
        self._node: int | None = None
        try:
            self._node = open_node(path, os.O_RDWR | os.O_EXCL | os.O_NONBLOCK | os.O_CLOEXEC)
            lock_node(self._node, path)
        except OSError as error:
            if error.errno == errno.EBUSY:
                raise in_use(path) from error
            raise self._translated("cannot open", error) from error
        except TransportError:
            self.close()
            raise

    def execute(
        self, cdb: bytes, data_out: bytes = b"", data_in_length: int = 0, timeout: float = DEFAULT_TIMEOUT_S
    ) -> Reply:
        """Send one command; see Transport."""
        check_command(self, cdb, data_out, data_in_length, timeout)
        if self._node is None:
            raise TransportError(f"{self._path} is closed", "connect to the scanner again")
        data = (ctypes.c_ubyte * (data_in_length or len(data_out))).from_buffer_copy(data_out or bytes(data_in_length))
        sense = (ctypes.c_ubyte * SENSE_BUFFER_LENGTH)()
        command = (ctypes.c_ubyte * len(cdb)).from_buffer_copy(cdb)
        header = _header(command, data, sense, direction=_direction(data_out, data_in_length), timeout=timeout)
        try:
            self._ioctl(self._node, SG_IO, header)
        except OSError as error:
            raise self._translated("cannot talk to", error) from error
        return with_sense(self, cdb, _reply(header, bytes(data), bytes(sense)), timeout)

    def close(self) -> None:
        """Close the device. Safe to call twice."""
        node, self._node = self._node, None
        if node is not None:
            os.close(node)

    def _translated(self, what: str, error: OSError) -> TransportError:
        hint = OPEN_HINTS.get(error.errno or 0, "check the scanner's power and cable, then try again")
        return TransportError(f"{what} {self._path}: {error.strerror or error}", hint)


def _direction(data_out: bytes, data_in_length: int) -> int:
    if data_out:
        return TO_DEVICE
    return FROM_DEVICE if data_in_length else NO_DATA


def _header(
    command: ctypes.Array[ctypes.c_ubyte],
    data: ctypes.Array[ctypes.c_ubyte],
    sense: ctypes.Array[ctypes.c_ubyte],
    *,
    direction: int,
    timeout: float,
) -> SgIoHeader:
    return SgIoHeader(
        interface_id=SCSI_GENERIC,
        dxfer_direction=direction,
        cmd_len=len(command),
        mx_sb_len=len(sense),
        dxfer_len=len(data),
        dxferp=ctypes.addressof(data) if len(data) else None,
        cmdp=ctypes.addressof(command),
        sbp=ctypes.addressof(sense),
        timeout=max(1, round(timeout * 1000)),  # 0 would be the kernel's default
    )


def _reply(header: SgIoHeader, data: bytes, sense: bytes) -> Reply:
    status = header.status & STATUS_MASK
    if header.host_status:
        raise _fault(HOST_FAULTS, header.host_status, "the SCSI card or bridge")
    if header.driver_status & DRIVER_MASK not in (0, DRIVER_SENSE):
        raise _fault({}, header.driver_status, "the SCSI driver")
    if not 0 <= header.resid <= len(data):
        raise TransportError(f"{header.resid} of {len(data)} bytes are said to be missing", "try again")
    if status == GOOD and header.dxfer_direction == TO_DEVICE and header.resid:
        raise TransportError(f"the device took only {len(data) - header.resid} of {len(data)} bytes", "try again")
    kept = data[: len(data) - header.resid] if header.dxfer_direction == FROM_DEVICE else b""
    return Reply(status, kept, sense[: header.sb_len_wr] if status == CHECK_CONDITION else b"")


def _fault(known: Mapping[int, tuple[str, str]], code: int, who: str) -> TransportError:
    message, hint = known.get(code, (f"{who} reports fault {code:#04x}", "check the cable, then try again"))
    return TransportError(message, hint)
