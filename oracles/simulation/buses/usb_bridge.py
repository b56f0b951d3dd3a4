"""A simulated USB–SCSI bridge as pyusb backend, instead of libusb: `usb.core.find(backend=SimulatedBridge(target))`."""

from __future__ import annotations

import errno
import os
from array import array
from collections.abc import Callable, Iterator, Mapping
from types import SimpleNamespace
from typing import Any

import usb.core
from usb.backend import IBackend

from drivers.scsi.bridges import MULTI_TARGET_REQUEST, MULTI_TARGET_REQUEST_TYPE
from drivers.scsi.bulk_only import RESET_REQUEST, RESET_REQUEST_TYPE
from drivers.scsi.transport import Target
from oracles.simulation.buses.bulk_only_device import BulkOnlyDevice, Ending, Halted, Overflow
from oracles.simulation.buses.usb_descriptors import (
    BULK_IN,
    CONFIGURATION,
    FULL_SPEED,
    configuration_descriptor,
    device_descriptor,
    endpoint_descriptor,
    interface_descriptor,
)

MICROTECH = (0x07AF, 0x0005)


class SimulatedBridge(IBackend):
    """A bridge with one SCSI device, and the cable to it.

    numbers         USB vendor and product number: they decide how the bridge takes SCSI IDs.
    scsi_id         where the device sits.
    packet_size     bytes of its longest packet; the shorter they are, the more can go wrong.
    faults          names out of `bulk_only_device.FAULTS` by the index of the command.
    kernel_driver   whether the kernel has a driver for it, which holds the interface.
    sleep           called with the seconds that the host waits for a transfer in vain.
    refuses_reset   whether only a reset of the port brings it back after a fault.
    log             what was done to the interface, for tests to read.
    """

    def __init__(
        self,
        target: Target,
        *,
        numbers: tuple[int, int] = MICROTECH,
        scsi_id: int = 5,
        packet_size: int = FULL_SPEED,
        faults: Mapping[int, str] | None = None,
        kernel_driver: bool = False,
        refuses_reset: bool = False,
        sleep: Callable[[float], None] | None = None,
    ) -> None:
        super().__init__()
        self.device = BulkOnlyDevice(
            target, numbers=numbers, scsi_id=scsi_id, packet_size=packet_size, faults=faults or {}
        )
        self.kernel_driver = self._known_to_kernel = kernel_driver
        self._sleep = sleep
        self.log: list[str] = []
        self._numbers, self._packet_size, self._refuses_reset = numbers, packet_size, refuses_reset

    def unplug(self) -> None:
        """Pull the cable."""
        self.device.unplugged = True

    def plug(self) -> None:
        """Put the cable in again: the bridge starts anew."""
        self.device.unplugged = False
        self.device.power_on()

    # What pyusb asks of the library below it. The device is its own handle: there is only one.

    def enumerate_devices(self) -> Iterator[Any]:
        return iter([] if self.device.unplugged else [self])

    def get_parent(self, _device: Any) -> None:
        return None

    def get_device_descriptor(self, _device: Any) -> SimpleNamespace:
        return device_descriptor(*self._numbers)

    def get_configuration_descriptor(self, _device: Any, index: int) -> SimpleNamespace:
        return configuration_descriptor(index)

    def get_interface_descriptor(self, _device: Any, index: int, alternate: int, _config: int) -> SimpleNamespace:
        return interface_descriptor(index, alternate)

    def get_endpoint_descriptor(self, _device: Any, index: int, *_where: int) -> SimpleNamespace:
        return endpoint_descriptor(index, self._packet_size)

    def open_device(self, _device: Any) -> SimulatedBridge:
        self._check_plugged()
        self.log.append("open")
        return self

    def close_device(self, _handle: Any) -> None:
        self.log.append("close")

    def get_configuration(self, _handle: Any) -> int:
        return CONFIGURATION

    def claim_interface(self, _handle: Any, _interface: int) -> None:
        self._check_plugged()
        if self.kernel_driver:
            raise _usb_error(errno.EBUSY)
        self.log.append("claim")

    def release_interface(self, _handle: Any, _interface: int) -> None:
        self._check_plugged()
        self.log.append("release")

    def is_kernel_driver_active(self, _handle: Any, _interface: int) -> bool:
        return self.kernel_driver

    def detach_kernel_driver(self, _handle: Any, _interface: int) -> None:
        self.kernel_driver = False
        self.log.append("detach kernel driver")

    def attach_kernel_driver(self, _handle: Any, _interface: int) -> None:
        if not self._known_to_kernel:
            raise _usb_error(errno.ENOENT)
        self.kernel_driver = True
        self.log.append("attach kernel driver")

    def clear_halt(self, _handle: Any, endpoint: int) -> None:
        self._check_plugged()
        self.device.clear_halts(inward=endpoint == BULK_IN)

    def reset_device(self, _handle: Any) -> None:
        self._check_plugged()
        self.log.append("port reset")
        self.device.power_on()

    def ctrl_transfer(
        self, _handle: Any, request_type: int, request: int, _value: int, _index: int, data: Any, _timeout: int
    ) -> int:
        self._check_plugged()
        asked = (request_type, request)
        if asked == (RESET_REQUEST_TYPE, RESET_REQUEST) and not self._refuses_reset:
            self.log.append("mass storage reset")
            self.device.reset()
        elif asked == (MULTI_TARGET_REQUEST_TYPE, MULTI_TARGET_REQUEST):
            self.device.multi_target = True
        else:
            raise _usb_error(errno.EPIPE)
        return len(data)

    def bulk_write(self, _handle: Any, _endpoint: int, _interface: int, data: array[int], _timeout: int) -> int:
        self._check_plugged()
        try:
            self.device.take(data.tobytes())
        except Halted:
            raise _usb_error(errno.EPIPE) from None
        self._check_plugged()
        return len(data)

    def bulk_read(self, _handle: Any, _endpoint: int, _interface: int, buffer: array[int], timeout: int) -> int:
        self._check_plugged()
        try:
            came, ending = self.device.give(len(buffer))
        except Overflow:
            raise _usb_error(errno.EOVERFLOW) from None
        buffer[: len(came)] = array("B", came)  # also what came before a halt: libusb reads into the caller's memory
        if ending is Ending.HALT:
            raise _usb_error(errno.EPIPE)
        if ending is Ending.SILENCE and not came:
            if self._sleep is not None:
                self._sleep(timeout / 1000)
            raise usb.core.USBTimeoutError(os.strerror(errno.ETIMEDOUT), None, errno.ETIMEDOUT)
        return len(came)

    def _check_plugged(self) -> None:
        if self.device.unplugged:
            raise _usb_error(errno.ENODEV)


def _usb_error(number: int) -> usb.core.USBError:
    return usb.core.USBError(os.strerror(number), None, number)
