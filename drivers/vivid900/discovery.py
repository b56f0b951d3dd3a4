"""What is plugged in: scanners behind /dev/sg*, USB–SCSI bridges and serial ports, found without doing any harm.

Nothing but INQUIRY is sent, and that only to what may be a scanner: what a SCSI device is called the kernel knows
already. Discovery knows no profile, so no laser can come on.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from drivers.scanner import ScannerError, TransportError
from drivers.vivid900.link import Link
from drivers.vivid900.scsi import Identity
from drivers.vivid900.transports import Transport
from drivers.vivid900.transports.bridges import BRIDGES, MAX_TARGET, Bridge

INITIATOR = MAX_TARGET  # the SCSI ID that cards and bridges have themselves
RESCAN = "- - -"  # every channel, ID and unit of a card (the kernel's Documentation/scsi)


@dataclass(frozen=True)
class Likeness:
    """Which devices are taken for scanners: those whose names have these words in them, in capitals or not.

    What a Vivid answers to INQUIRY is not known for certain.
    """

    vendor: str = "MINOLTA"
    product: str = "VIVID"

    def fits(self, identity: Identity) -> bool:
        """Whether a device is taken for a scanner."""
        return self.vendor.upper() in identity.vendor.upper() and self.product.upper() in identity.product.upper()


@dataclass(frozen=True)
class ScsiDevice:
    """A SCSI device: where it is, what it says of itself, and what keeps us from using it.

    where       its node, or its bridge and SCSI ID.
    is_scanner  whether it is taken for one; others were not asked anything.
    problem     why it cannot be used, empty when it answers; hint: what to do now.
    """

    where: str
    identity: Identity
    is_scanner: bool
    problem: str = ""
    hint: str = ""


@dataclass(frozen=True)
class UsbBridge:
    """A USB–SCSI bridge. node: the file that libusb uses; usable: whether we may."""

    vendor: int
    product: int
    bridge: Bridge
    node: Path
    usable: bool

    def __str__(self) -> str:
        return f"{self.vendor:04x}:{self.product:04x} {self.bridge.name}"


@dataclass(frozen=True)
class SerialPort:
    """A serial port, for a rotary stage. usable: whether we may open it."""

    node: Path
    description: str
    usable: bool


def _open_sg(node: Path) -> Transport:
    from drivers.vivid900.transports.sg import SgDevice

    return SgDevice(node)


def _usb_devices() -> Iterable[Any]:
    import usb.core

    from drivers.vivid900.transports.usb import load_backend

    return list(usb.core.find(find_all=True, backend=load_backend()))


def _serial_ports() -> Iterable[Any]:
    from serial.tools.list_ports import comports

    return list(comports())


def _may_use(node: Path) -> bool:
    return os.access(node, os.R_OK | os.W_OK)


@dataclass(frozen=True)
class Host:
    """The computer that is searched. usb_devices: those of pyusb; serial_ports: those of pyserial."""

    sys: Path = Path("/sys")
    dev: Path = Path("/dev")
    open_sg: Callable[[Path], Transport] = _open_sg
    usb_devices: Callable[[], Iterable[Any]] = _usb_devices
    serial_ports: Callable[[], Iterable[Any]] = _serial_ports
    may_use: Callable[[Path], bool] = _may_use

    @property
    def scsi_generic(self) -> Path:
        """Where the kernel lists the nodes sg*."""
        return self.sys / "class/scsi_generic"


def find_scsi(host: Host, likeness: Likeness) -> list[ScsiDevice]:
    """Every SCSI device that the kernel knows; those like a scanner are asked whether they are there."""
    found = []
    for entry in sorted(host.scsi_generic.glob("sg*"), key=lambda entry: (len(entry.name), entry.name)):
        node, told = host.dev / entry.name, _as_the_kernel_says(entry / "device")
        if likeness.fits(told):
            found.append(_ask(str(node), told, partial(host.open_sg, node)))
        else:
            found.append(ScsiDevice(str(node), told, is_scanner=False))
    return found


def _as_the_kernel_says(device: Path) -> Identity:
    vendor, product, revision, kind = (_text(device / name) for name in ("vendor", "model", "rev", "type"))
    return Identity(int(kind) & 0x1F if kind.isdigit() else 0x1F, vendor, product, revision)


def _text(file: Path) -> str:
    try:
        return file.read_text("ascii", "replace").strip()
    except OSError:  # it may be unplugged just now
        return ""


def _ask(where: str, told: Identity, connect: Callable[[], Transport]) -> ScsiDevice:
    try:
        transport = connect()
        try:
            return ScsiDevice(where, Link(transport).identify(), is_scanner=True)
        finally:
            transport.close()
    except ScannerError as error:
        return ScsiDevice(where, told, is_scanner=True, problem=str(error), hint=error.hint)


def find_bridges(host: Host) -> list[UsbBridge]:
    """Every USB–SCSI bridge of the table. Raises TransportError without libusb."""
    return [_bridge(host, device) for device in host.usb_devices() if _numbers(device) in BRIDGES]


def _bridge(host: Host, device: Any) -> UsbBridge:
    node = host.dev / f"bus/usb/{device.bus:03d}/{device.address:03d}"
    return UsbBridge(*_numbers(device), BRIDGES[_numbers(device)], node, host.may_use(node))


def _numbers(device: Any) -> tuple[int, int]:
    return device.idVendor, device.idProduct


def probe_bridges(host: Host, likeness: Likeness) -> Iterator[ScsiDevice]:
    """Ask every SCSI ID behind every bridge who is there: for bridges that the kernel gives no nodes.

    The kernel's driver loses the bridge meanwhile: disks behind it must not be mounted. Raises TransportError without
    libusb.
    """
    from drivers.vivid900.transports.usb import UsbBulkOnly

    for device in host.usb_devices():
        bridge = BRIDGES.get(_numbers(device))
        if bridge is None or bridge.sleeping:
            continue
        for target in range(INITIATOR):
            try:
                transport = UsbBulkOnly(device, target=target)
            except TransportError:
                break
            try:
                identity = Link(transport).identify()
            except ScannerError:
                continue
            finally:
                transport.close()
            yield ScsiDevice(f"{bridge.name}, SCSI ID {target}", identity, likeness.fits(identity))


def find_serial_ports(host: Host) -> list[SerialPort]:
    """Every serial port that has hardware behind it."""
    ports = ((Path(port.device), port.description) for port in host.serial_ports())
    return [SerialPort(node, description, host.may_use(node)) for node, description in sorted(ports)]


def rescan(host: Host) -> int:
    """Let every SCSI card look for devices that were switched on after the computer; how many cards there are.

    Raises TransportError when we may not.
    """
    cards = sorted((host.sys / "class/scsi_host").glob("host*/scan"))
    for card in cards:
        try:
            card.write_text(RESCAN)
        except OSError as error:
            hint = f"let the administrator do it: echo '{RESCAN}' | sudo tee {card}"
            raise TransportError(f"cannot search the SCSI bus anew: {error.strerror}", hint) from error
    return len(cards)
