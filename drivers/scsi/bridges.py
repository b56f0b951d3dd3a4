"""The known USB–SCSI bridges, by their USB vendor and product numbers.

Sources: the Linux kernel's drivers/usb/storage/unusual_devs.h and initializers.c (the Shuttle/SCM family, sold as
Microtech, Belkin and Adaptec USBConnect); for the USB2Xchange the linux-usb-devel list (mail of 2006-01-30 on its
target numbers) and the measurements of the open driver AdamLeyshon/usb2xchange. None was tried with a Vivid.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any


class Addressing(Enum):
    """How a bridge encodes the target's SCSI ID in the Bulk-Only LUN byte."""

    NONE = "the bridge has one device"
    UPPER_NIBBLE = "SCSI ID in the upper half, unit in the lower"
    WHOLE_BYTE = "SCSI ID alone"

    def lun_byte(self, target: int, lun: int = 0) -> int:
        """The LUN byte of the wrapper for SCSI ID `target` (0 to 7)."""
        return {Addressing.NONE: lun, Addressing.UPPER_NIBBLE: target << 4 | lun, Addressing.WHOLE_BYTE: target}[self]


@dataclass(frozen=True)
class Bridge:
    """One bridge.

    multi_target  SCSI IDs other than 0 must be enabled first, by a vendor request.
    sleeping      it needs its firmware, and re-enumerates under another product number when that is loaded.
    """

    name: str
    addressing: Addressing = Addressing.UPPER_NIBBLE
    multi_target: bool = False
    sleeping: bool = False


_SCM = "Shuttle/SCM eUSCSI bridge"

BRIDGES = {
    (0x07AF, 0x0004): Bridge("Microtech USB-SCSI-DB25", multi_target=True),
    (0x07AF, 0x0005): Bridge("Microtech USB-SCSI-HD50 (XpressSCSI)", multi_target=True),
    (0x04E6, 0x0002): Bridge(_SCM, multi_target=True),
    (0x04E6, 0x000B): Bridge(_SCM, multi_target=True),
    (0x04E6, 0x000C): Bridge(_SCM, multi_target=True),
    (0x04E6, 0x000F): Bridge("SCM eUSB SCSI adapter", multi_target=True),
    (0x050D, 0x0115): Bridge("Belkin USB SCSI adaptor", multi_target=True),
    (0x03F3, 0x0001): Bridge("Adaptec USBConnect 2000", multi_target=True),
    (0x03F3, 0x2000): Bridge("Adaptec USBXchange", Addressing.WHOLE_BYTE, sleeping=True),
    (0x03F3, 0x2001): Bridge("Adaptec USBXchange", Addressing.WHOLE_BYTE),
    (0x03F3, 0x2002): Bridge("Adaptec USB2Xchange", Addressing.WHOLE_BYTE, sleeping=True),
    (0x03F3, 0x2003): Bridge("Adaptec USB2Xchange", Addressing.WHOLE_BYTE),
}

PLAIN_BRIDGE = Bridge("Bulk-Only mass-storage device", Addressing.NONE)
"""Any other: assumed to follow the standard, with one device."""

MAX_TARGET = 7  # a narrow SCSI bus has eight IDs; the USB2Xchange hangs when asked for another

# Enables SCSI IDs in the Shuttle/SCM family (the kernel's usb_stor_euscsi_init): a vendor request to the interface.
MULTI_TARGET_REQUEST_TYPE, MULTI_TARGET_REQUEST, MULTI_TARGET_ON = 0x41, 0x0C, b"\x01"


def device_node(device: Any, dev: Path = Path("/dev")) -> Path:
    """The file through which libusb uses a device of pyusb. dev: folder of the nodes."""
    return dev / f"bus/usb/{device.bus:03d}/{device.address:03d}"
