"""Simulates the kernel's SG_IO ioctl, with any Target as the device."""

from __future__ import annotations

import ctypes
import errno
import os
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drivers.scanner import TransportError
from drivers.scsi.commands import REQUEST_SENSE, request_sense
from drivers.scsi.sense import SENSE_LENGTH
from drivers.scsi.sg import FROM_DEVICE, SCSI_GENERIC, SG_IO, TO_DEVICE, SgDevice, SgIoHeader
from drivers.scsi.transport import CHECK_CONDITION, Target
from oracles.simulation.device_faults import NoAnswer

NO_CONNECTION, CARD_FAULT = 0x01, 0x07  # DID_NO_CONNECT; DID_ERROR, which is what more data than asked for ends with
TIMED_OUT = 0x03  # DID_TIME_OUT
DRIVER_TIMEOUT, RESERVED_BITS = 0x06, 0xC1  # of the driver's status; of the SCSI status
UNKNOWN_HOST_FAULT = 0x7F
FLIPPED = 0x5A  # exclusive-ored into a damaged byte


@dataclass(frozen=True)
class Fault:
    """A fault of the kernel, the card or the bus.

    edit      modifies the header that the kernel returns, or raises OSError as the ioctl does.
    executed  whether the device receives the command all the same.
    waits     whether the kernel waits until the command's time-out.
    """

    edit: Callable[[SgIoHeader], None]
    executed: bool = True
    waits: bool = False


def _set(field: str, value: int) -> Callable[[SgIoHeader], None]:
    return lambda header: setattr(header, field, value)


def _host(code: int, *, executed: bool = True) -> Fault:
    return Fault(_set("host_status", code), executed)


def _refuse(number: int) -> Callable[[SgIoHeader], None]:
    def refuse(_header: SgIoHeader) -> None:
        raise OSError(number, os.strerror(number))

    return refuse


def _halve(header: SgIoHeader) -> None:
    if header.dxfer_direction == FROM_DEVICE:
        header.resid = header.dxfer_len - (header.dxfer_len - header.resid) // 2


def _damage(header: SgIoHeader) -> None:
    """Parity error: the card reports it beside the damaged data."""
    header.host_status = 0x06
    if header.dxfer_direction == FROM_DEVICE and header.dxfer_len:
        first = ctypes.string_at(header.dxferp, 1)[0]
        ctypes.memset(header.dxferp, first ^ FLIPPED, 1)


FAULTS: Mapping[str, Fault] = {
    "no connection": _host(NO_CONNECTION, executed=False),
    "bus busy": _host(0x02, executed=False),
    "host time-out": Fault(_set("host_status", TIMED_OUT), waits=True),
    "host time-out, not executed": Fault(_set("host_status", TIMED_OUT), executed=False, waits=True),
    "bad target": _host(0x04, executed=False),
    "aborted by the host": _host(0x05),
    "parity error": Fault(_damage),
    "card fault": _host(CARD_FAULT),
    "card fault, not executed": _host(CARD_FAULT, executed=False),
    "bus reset": _host(0x08),
    "unknown host fault": _host(UNKNOWN_HOST_FAULT),
    "driver time-out": Fault(_set("driver_status", DRIVER_TIMEOUT), waits=True),
    "negative residue": Fault(_set("resid", -1)),
    "senseless residue": Fault(_set("resid", 1 << 30)),
    "half the data": Fault(_halve),
    "no sense data": Fault(_set("sb_len_wr", 0)),
    "reserved status bits": Fault(lambda header: setattr(header, "status", header.status | RESERVED_BITS)),
    "node is gone": Fault(_refuse(errno.ENODEV), executed=False),
    "I/O error": Fault(_refuse(errno.EIO)),
    "no kernel memory": Fault(_refuse(errno.ENOMEM), executed=False),
}
"""Every fault by its name."""


class SimulatedSgNode:
    """A node to open and its ioctl.

    faults  injected faults by the index of the command.
    sleep   called with the seconds that the kernel waits for an answer in vain.
    """

    def __init__(
        self,
        target: Target,
        *,
        faults: Mapping[int, Fault] | None = None,
        sleep: Callable[[float], None] = lambda _seconds: None,
    ) -> None:
        self._target, self._sleep = target, sleep
        self.faults = dict(faults or {})
        self.commands = 0
        self._opened: tuple[int, int] | None = None  # descriptor and inode of the last opening

    def connect(self, path: Path = Path("/dev/sg0"), **options: Any) -> SgDevice:
        """The driver's end of this node; the path is only its name."""
        return SgDevice(path, ioctl=self.ioctl, open_node=self.open, **options)

    def open(self, path: Path, flags: int) -> int:
        """A descriptor of the node. Raises OSError (EBUSY) while another one is open and O_EXCL is asked for."""
        if flags & os.O_EXCL and self.is_open():
            raise OSError(errno.EBUSY, os.strerror(errno.EBUSY), str(path))
        with tempfile.TemporaryFile() as file:
            descriptor = os.dup(file.fileno())
        self._opened = descriptor, os.fstat(descriptor).st_ino
        return descriptor

    def close(self) -> None:
        """Close the last opening, as the kernel does when its process ends."""
        if self.is_open() and self._opened is not None:
            os.close(self._opened[0])

    def is_open(self) -> bool:
        """Whether the last opening is still open."""
        if self._opened is None:
            return False
        try:
            return os.fstat(self._opened[0]).st_ino == self._opened[1]
        except OSError:  # closed
            return False

    def ioctl(self, _node: int, request: int, header: Any) -> int:
        """SG_IO as `fcntl.ioctl` does it. Raises OSError as the kernel does."""
        if request != SG_IO or header.interface_id != SCSI_GENERIC:
            raise OSError(errno.ENOTTY, os.strerror(errno.ENOTTY))
        index, self.commands = self.commands, self.commands + 1
        fault = self.faults.get(index)
        if fault is None or fault.executed:
            self._run(header)
        if fault is not None:
            if fault.waits:
                self._sleep(header.timeout / 1000)
            fault.edit(header)
        return 0

    def _run(self, header: SgIoHeader) -> None:
        cdb = ctypes.string_at(header.cmdp, header.cmd_len)
        moved = ctypes.string_at(header.dxferp, header.dxfer_len) if header.dxferp else b""
        inward = header.dxfer_direction == FROM_DEVICE
        data_out = moved if header.dxfer_direction == TO_DEVICE else b""
        try:
            reply = self._target.execute(cdb, data_out, header.dxfer_len if inward else 0)
        except NoAnswer:
            self._sleep(header.timeout / 1000)
            header.host_status = TIMED_OUT
            return
        except TransportError:  # the device is off, or its cable is out
            header.host_status = NO_CONNECTION
            return
        header.status = reply.status
        if inward:
            data = reply.data[: header.dxfer_len]
            ctypes.memmove(header.dxferp, data, len(data))
            header.resid = header.dxfer_len - len(data)
            if len(data) < len(reply.data):
                header.host_status = CARD_FAULT
        if reply.status == CHECK_CONDITION and cdb[0] != REQUEST_SENSE:
            reply = self._target.execute(request_sense(SENSE_LENGTH), b"", SENSE_LENGTH)
            sense = reply.data[: header.mx_sb_len]
            ctypes.memmove(header.sbp, sense, len(sense))
            header.sb_len_wr = len(sense)
