"""A SCSI device behind a USB bridge that speaks mass storage's Bulk-Only transport.

Source: USB Mass Storage Class, Bulk-Only Transport, revision 1.0, §5.3 and §6.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import libusb_package
import usb.core

from drivers.scanner import SettingsError, TransportError
from drivers.scsi.bridges import BRIDGES, MAX_TARGET, PLAIN_BRIDGE, Bridge
from drivers.scsi.bulk_exchange import Deadline, NoSuchTarget, run_command
from drivers.scsi.bulk_only import CommandWrapper
from drivers.scsi.checks import SAFE_TRANSFER, check_command, with_sense
from drivers.scsi.pipes import Pipes
from drivers.scsi.transport import BUSY, CHECK_CONDITION, DEFAULT_TIMEOUT_S, Reply

MAX_TAG = 0xFFFFFFFF
FIRMWARE_HINT = "load it with the open tool xchange-fw (see docs/how-to/connect-a-vivid-900.md), then try again"
NO_SENSE = (0, 0, 0)  # sense key with its flags, ASC and ASCQ when sense data is missing

Clock = Callable[[], float]


def load_backend() -> Any:
    """Return pyusb's backend with the libusb of the libusb-package wheel.

    Raises TransportError without one.
    """
    backend = libusb_package.get_libusb1_backend()
    if backend is None:
        raise TransportError("libusb cannot be loaded", "install it: pip install --force-reinstall libusb-package")
    return backend


def find_device(vendor: int, product: int, *, backend: Any = None) -> usb.core.Device:
    """Return the USB device with these numbers.

    Raises TransportError when it is not connected.
    """
    device = usb.core.find(idVendor=vendor, idProduct=product, backend=backend or load_backend())
    if device is None:
        raise TransportError(f"no USB device {vendor:04x}:{product:04x}", "look for the bridge with: planish devices")
    return device


class UsbBulkOnly:
    """The device at one SCSI ID behind a USB bridge.

    bridge  its entry in BRIDGES; by default found by its USB numbers.
    node    file of the bridge, to be locked; see `Pipes`.
    Raises TransportError when the bridge cannot be used, SettingsError for a SCSI ID that no bus has.
    """

    def __init__(
        self,
        device: usb.core.Device,
        *,
        target: int = 0,
        bridge: Bridge | None = None,
        node: Path | None = None,
        max_transfer: int = SAFE_TRANSFER,
        clock: Clock = time.monotonic,
    ) -> None:
        if not 0 <= target <= MAX_TARGET:
            raise SettingsError(f"SCSI ID {target} is out of range", f"use a SCSI ID from 0 to {MAX_TARGET}")
        self.max_transfer = max_transfer
        self._bridge = bridge or BRIDGES.get((device.idVendor, device.idProduct), PLAIN_BRIDGE)
        if self._bridge.sleeping:
            raise TransportError(f"the {self._bridge.name} waits for its firmware", FIRMWARE_HINT)
        self._lun = self._bridge.addressing.lun_byte(target)
        self._clock = clock
        self._pipes: Pipes | None = Pipes(device, self._bridge, node)
        # A killed program may have left a command half done, and its answer must not be mistaken for that of ours: the
        # pipes are brought in step before the first command, whose tag repeats none of another program's.
        self._tag = secrets.randbelow(MAX_TAG)
        self._out_of_step = True

    def execute(
        self, cdb: bytes, data_out: bytes = b"", data_in_length: int = 0, timeout: float = DEFAULT_TIMEOUT_S
    ) -> Reply:
        """Send one command; see Transport.

        Bulk-Only reports only "failed". NO SENSE after it means busy or reserved: BUSY.
        """
        check_command(self, cdb, data_out, data_in_length, timeout)
        reply = with_sense(self, cdb, self._command(cdb, data_out, data_in_length, timeout), timeout)
        return Reply(BUSY) if _has_no_sense(reply) else reply

    def close(self) -> None:
        """Close the bridge, ready for the next program. Safe to call twice."""
        pipes, self._pipes = self._pipes, None
        if pipes is None:
            return
        if self._out_of_step:
            with suppress(TransportError):  # it may have been unplugged
                pipes.recover()
        pipes.close()

    def _command(self, cdb: bytes, data_out: bytes, length: int, timeout: float) -> Reply:
        """Do the command, data and status phase of one command.

        Until it has succeeded the pipes count as out of step. That includes every exception, KeyboardInterrupt too:
        whatever the bridge has still to send or receive is discarded by reset recovery before the next command.
        """
        if self._pipes is None:
            raise TransportError("the bridge is closed", "connect to the scanner again")
        if self._out_of_step:
            self._pipes.recover()
        self._out_of_step = True
        self._tag = self._tag % MAX_TAG + 1
        wrapper = CommandWrapper(self._tag, length or len(data_out), length > 0, self._lun, cdb)
        try:
            reply = run_command(self._pipes, wrapper, data_out, Deadline(self._clock, timeout))
        except NoSuchTarget:
            self._out_of_step = False
            raise
        self._out_of_step = False
        return reply


def _has_no_sense(reply: Reply) -> bool:
    sense = reply.sense
    return reply.status == CHECK_CONDITION and len(sense) >= 14 and (sense[2], sense[12], sense[13]) == NO_SENSE
