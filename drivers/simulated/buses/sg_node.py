"""Simulates the kernel's SG_IO ioctl, with any Target as the device."""

from __future__ import annotations

import ctypes
import errno
import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from drivers.scanner import TransportError
from drivers.vivid900.scsi import REQUEST_SENSE, request_sense
from drivers.vivid900.sense import SENSE_LENGTH
from drivers.vivid900.transports import CHECK_CONDITION, Target
from drivers.vivid900.transports.sg import FROM_DEVICE, SCSI_GENERIC, SG_IO, TO_DEVICE, SgDevice, SgIoHeader

NO_CONNECTION, CARD_FAULT = 0x01, 0x07  # DID_NO_CONNECT; DID_ERROR, which is what more data than asked for ends with

Fault = Callable[[SgIoHeader], None]
"""Modifies the header that the kernel returns, or raises OSError as the ioctl does."""


class SimulatedSgNode:
    """A node to open and its ioctl. faults: injected faults by the index of the command."""

    def __init__(self, target: Target, *, faults: Mapping[int, Fault] | None = None) -> None:
        self._target = target
        self.faults = dict(faults or {})
        self.commands = 0
        self._opened: tuple[int, int] | None = None  # descriptor and inode of the last opening

    def connect(self, path: Path = Path("/dev/sg0"), **options: Any) -> SgDevice:
        """The driver's end of this node; the path is only its name."""
        return SgDevice(path, ioctl=self.ioctl, open_node=self.open, **options)

    def open(self, path: Path, flags: int) -> int:
        """A descriptor of the node. Raises OSError (EBUSY) while another one is open and O_EXCL is asked for."""
        if flags & os.O_EXCL and self._is_open():
            raise OSError(errno.EBUSY, os.strerror(errno.EBUSY), str(path))
        with tempfile.TemporaryFile() as file:
            descriptor = os.dup(file.fileno())
        self._opened = descriptor, os.fstat(descriptor).st_ino
        return descriptor

    def _is_open(self) -> bool:
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
        self._run(header)
        if index in self.faults:
            self.faults[index](header)
        return 0

    def _run(self, header: SgIoHeader) -> None:
        cdb = ctypes.string_at(header.cmdp, header.cmd_len)
        moved = ctypes.string_at(header.dxferp, header.dxfer_len) if header.dxferp else b""
        inward = header.dxfer_direction == FROM_DEVICE
        data_out = moved if header.dxfer_direction == TO_DEVICE else b""
        try:
            reply = self._target.execute(cdb, data_out, header.dxfer_len if inward else 0)
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
