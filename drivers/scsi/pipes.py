"""The two bulk pipes of a USB mass-storage interface, through pyusb.

Errors of pyusb are translated here.
"""

from __future__ import annotations

import errno
import os
from array import array
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import usb.core
import usb.util

from drivers.scanner import TransportError
from drivers.scsi.bridges import MULTI_TARGET_ON, MULTI_TARGET_REQUEST, MULTI_TARGET_REQUEST_TYPE, Bridge
from drivers.scsi.bulk_only import RESET_REQUEST, RESET_REQUEST_TYPE
from drivers.scsi.ownership import in_use, open_locked

CONTROL_TIMEOUT_MS = 5000  # as in the kernel's driver

HINTS = {
    errno.EACCES: "you may not use this bridge: planish doctor shows the udev rule to add",
    errno.EPERM: "you may not use this bridge: planish doctor shows the udev rule to add",
    errno.EBUSY: "another program uses the bridge: close it",
    errno.ENODEV: "the bridge was unplugged: plug it in again and start over",
    errno.ETIMEDOUT: "check that the scanner is on and its cable sits; switch it off, wait 5 s, and on again",
    errno.EOVERFLOW: "the bridge sent more than was asked for: plug it in again and start over",
}


class Stall(Exception):
    """Raised when the bridge halts the pipe (STALL)."""


@contextmanager
def translated(what: str) -> Iterator[None]:
    """Turn pyusb's errors into Stall and TransportError."""
    try:
        yield
    except usb.core.USBError as error:
        if error.errno == errno.EPIPE:
            raise Stall(what) from error
        hint = HINTS.get(error.errno or 0, "plug the bridge in again and start over")
        raise TransportError(f"{what}: {error.strerror}", hint) from error


class Pipes:
    """Claimed interface with one bulk pipe in each direction.

    node: file of the device, locked for this process; without one only libusb's claim excludes others.
    Raises TransportError when the device has no such interface.
    """

    def __init__(self, device: usb.core.Device, bridge: Bridge, node: Path | None = None) -> None:
        self._device, self._bridge, self._node = device, bridge, node
        self._number, self._taken = 0, False
        self._lock = None if node is None else open_locked(node)
        try:
            with translated("cannot open the bridge"):
                self._number, self._in, self._out = _find_pipes(device)
                self._taken = _detach_kernel_driver(device, self._number)
                self._claim()
        except Stall as stall:
            self.close()
            raise TransportError(str(stall), "plug the bridge in again and start over") from stall
        except BaseException:
            self.close()
            raise

    def write(self, data: bytes, timeout_ms: int) -> int:
        """Send bytes to the bridge and return the number accepted.

        Raises Stall, TransportError.
        """
        with translated("cannot send to the bridge"):
            return int(self._device.write(self._out, data, timeout_ms))

    def read(self, buffer: array[int], timeout_ms: int) -> int:
        """Fill the buffer of unsigned bytes and return their number.

        A short packet ends the transfer before the buffer is full.
        Raises Stall (received bytes are in the buffer), TransportError.
        """
        with translated("cannot read from the bridge"):
            return int(self._device.read(self._in, buffer, timeout_ms))

    def clear_in(self) -> None:
        """End the halt of the pipe from the bridge. Raises Stall, TransportError."""
        with translated("cannot restart the pipe from the bridge"):
            self._device.clear_halt(self._in)

    def clear_out(self) -> None:
        """End the halt of the pipe to the bridge. Raises Stall, TransportError."""
        with translated("cannot restart the pipe to the bridge"):
            self._device.clear_halt(self._out)

    def recover(self) -> None:
        """Do the reset recovery (Bulk-Only §5.3.4), or reset the port.

        The port is reset where the bridge refuses the recovery. Raises TransportError when neither succeeds.
        """
        try:
            with translated("the bridge does not reset"):
                self._device.ctrl_transfer(RESET_REQUEST_TYPE, RESET_REQUEST, 0, self._number, None, CONTROL_TIMEOUT_MS)
            self.clear_in()
            self.clear_out()
        except (Stall, TransportError):
            self._reset_port()

    def close(self) -> None:
        """Release the interface and re-attach the kernel's driver, if any.

        Safe to call twice. A killed run leaves the interface without the driver that it detached: this restores that,
        too.
        """
        with suppress(usb.core.USBError):  # it may have been unplugged
            usb.util.release_interface(self._device, self._number)
        if self._taken:
            self._taken = False
            with suppress(usb.core.USBError, NotImplementedError):  # the kernel has no driver for many bridges
                self._device.attach_kernel_driver(self._number)
        usb.util.dispose_resources(self._device)
        lock, self._lock = self._lock, None
        if lock is not None:
            os.close(lock)

    def _reset_port(self) -> None:
        try:
            with translated("the bridge does not come back from a reset"):
                self._device.reset()
                self._claim()
        except Stall as stall:
            raise TransportError(str(stall), "plug the bridge in again and start over") from stall

    def _claim(self) -> None:
        try:
            usb.util.claim_interface(self._device, self._number)
        except usb.core.USBError as error:
            if error.errno == errno.EBUSY and self._node is not None:
                raise in_use(self._node) from error
            raise
        self._taken = True
        if self._bridge.multi_target:
            # A refusal is ignored, as in the kernel: the bridge then has one target.
            with suppress(Stall), translated("cannot set the SCSI IDs of the bridge"):
                self._device.ctrl_transfer(
                    MULTI_TARGET_REQUEST_TYPE, MULTI_TARGET_REQUEST, 1, 0, MULTI_TARGET_ON, CONTROL_TIMEOUT_MS
                )


def _find_pipes(device: usb.core.Device) -> tuple[int, int, int]:
    """Return the first bulk interface and its addresses, in and out.

    Its class is not checked: the USB2Xchange speaks Bulk-Only and calls itself vendor-specific.
    """
    for interface in device.get_active_configuration():
        bulk = [
            endpoint.bEndpointAddress
            for endpoint in interface
            if usb.util.endpoint_type(endpoint.bmAttributes) == usb.util.ENDPOINT_TYPE_BULK
        ]
        ways = {usb.util.endpoint_direction(address): address for address in reversed(bulk)}
        if ways.keys() >= {usb.util.ENDPOINT_IN, usb.util.ENDPOINT_OUT}:
            return interface.bInterfaceNumber, ways[usb.util.ENDPOINT_IN], ways[usb.util.ENDPOINT_OUT]
    raise TransportError("this USB device has no pair of bulk pipes", "is it a USB–SCSI bridge? See: planish devices")


def _detach_kernel_driver(device: usb.core.Device, number: int) -> bool:
    try:
        if not device.is_kernel_driver_active(number):
            return False
    except NotImplementedError:  # only Linux has such drivers
        return False
    device.detach_kernel_driver(number)
    return True
