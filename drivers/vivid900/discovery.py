"""Finds scanners behind /dev/sg*, bridges and serial ports, read-only.

Only INQUIRY is sent, and only to candidate scanners: the names of SCSI devices are known to the kernel. Discovery has
no profile, so no laser can come on.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from drivers.scanner import ScannerError, TransportError
from drivers.scsi.bridges import BRIDGES, MAX_TARGET, Bridge, device_node
from drivers.scsi.commands import Identity
from drivers.scsi.transport import Transport
from drivers.vivid900.link import Link

UNNAMED = Identity(0x1F, "", "", "")
INITIATOR = MAX_TARGET  # the SCSI ID that cards and bridges have themselves
PROBE_S = 3.0  # for INQUIRY, which every device answers at once; a SCSI ID without a device may take all of it
RESCAN = "- - -"  # every channel, ID and unit of a card (the kernel's Documentation/scsi)


@dataclass(frozen=True)
class NameFilter:
    """Filter of INQUIRY names: a scanner's names contain these words, in any case.

    The exact INQUIRY names of a Vivid are not known.
    """

    vendor: str = "MINOLTA"
    product: str = "VIVID"

    def fits(self, identity: Identity) -> bool:
        """Whether a device counts as a scanner."""
        return self.vendor.upper() in identity.vendor.upper() and self.product.upper() in identity.product.upper()


@dataclass(frozen=True)
class ScsiDevice:
    """SCSI device: node or bridge, INQUIRY data, and why it cannot be used.

    where       its node, or its bridge and SCSI ID.
    is_scanner  whether its names pass the filter; behind a node of the kernel other devices are sent no command.
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
    """A serial port, for a turntable. usable: whether we may open it."""

    node: Path
    description: str
    usable: bool


def _open_sg(node: Path) -> Transport:
    from drivers.scsi.sg import SgDevice

    return SgDevice(node)


def _usb_devices() -> Iterable[Any]:
    import usb.core

    from drivers.scsi.usb import load_backend

    return list(usb.core.find(find_all=True, backend=load_backend()))


def _serial_ports() -> Iterable[Any]:
    from serial.tools.list_ports import comports

    return list(comports())


def _may_use(node: Path) -> bool:
    return os.access(node, os.R_OK | os.W_OK)


@dataclass(frozen=True)
class Host:
    """The computer that is searched.

    usb_devices: those of pyusb.
    serial_ports: those of pyserial.
    """

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


def find_scsi(host: Host, name_filter: NameFilter) -> list[ScsiDevice]:
    """List every SCSI device that the kernel knows.

    Those whose names pass the filter are sent INQUIRY.
    """
    found = []
    for entry in sorted(host.scsi_generic.glob("sg*"), key=lambda entry: (len(entry.name), entry.name)):
        node, identity = host.dev / entry.name, _kernel_identity(entry / "device")
        if name_filter.fits(identity):
            found.append(_inquire(str(node), identity, partial(host.open_sg, node)))
        else:
            found.append(ScsiDevice(str(node), identity, is_scanner=False))
    return found


def _kernel_identity(device: Path) -> Identity:
    vendor, product, revision, kind = (_text(device / name) for name in ("vendor", "model", "rev", "type"))
    return Identity(int(kind) & 0x1F if kind.isdigit() else 0x1F, vendor, product, revision)


def _text(file: Path) -> str:
    try:
        return file.read_text("ascii", "replace").strip()
    except OSError:  # unplugged meanwhile
        return ""


def _inquire(where: str, listed: Identity, connect: Callable[[], Transport]) -> ScsiDevice:
    try:
        transport = connect()
        try:
            return ScsiDevice(where, Link(transport).identify(), is_scanner=True)
        finally:
            transport.close()
    except ScannerError as error:
        return ScsiDevice(where, listed, is_scanner=True, problem=str(error), hint=error.hint)


def find_bridges(host: Host) -> list[UsbBridge]:
    """Every USB–SCSI bridge of the table. Raises TransportError without libusb."""
    return [_bridge(host, device) for device in host.usb_devices() if _numbers(device) in BRIDGES]


def _bridge(host: Host, device: Any) -> UsbBridge:
    node = device_node(device, host.dev)
    return UsbBridge(*_numbers(device), BRIDGES[_numbers(device)], node, host.may_use(node))


def _numbers(device: Any) -> tuple[int, int]:
    return device.idVendor, device.idProduct


def probe_bridges(
    host: Host, name_filter: NameFilter, report: Callable[[str], None] = lambda _text: None
) -> Iterator[ScsiDevice]:
    """Send INQUIRY to every SCSI ID behind every bridge.

    This finds scanners behind bridges without nodes of the kernel.
    report  called before each of them: one without a device may take PROBE_S.
    A bridge that cannot be used comes as a device without names, with its problem. The kernel's driver is detached
    meanwhile: disks behind the bridge must not be mounted. Raises TransportError without libusb.
    """
    for device in host.usb_devices():
        bridge = BRIDGES.get(_numbers(device))
        if bridge is None or bridge.sleeping:
            continue
        for target in range(INITIATOR):
            where = f"{bridge.name}, SCSI ID {target}"
            report(f"asking {where}")
            try:
                identity = _probe(device, target, device_node(device, host.dev))
            except _Unusable as unusable:
                yield ScsiDevice(bridge.name, UNNAMED, is_scanner=False, problem=str(unusable), hint=unusable.hint)
                break
            if identity is not None:
                yield ScsiDevice(where, identity, name_filter.fits(identity))


class _Unusable(TransportError):
    """Raised when a bridge itself cannot be used, whatever is behind it."""


def _probe(device: Any, target: int, node: Path) -> Identity | None:
    """Return INQUIRY data of the device at a SCSI ID, None without an answer.

    Raises _Unusable.
    """
    from drivers.scsi.usb import UsbBulkOnly

    try:
        transport = UsbBulkOnly(device, target=target, node=node)
    except TransportError as error:
        raise _Unusable(str(error), error.hint) from error
    try:
        return Link(transport, command_s=PROBE_S).identify()
    except ScannerError:
        return None
    finally:
        transport.close()


def find_serial_ports(host: Host) -> list[SerialPort]:
    """Every serial port that has hardware behind it."""
    ports = ((Path(port.device), port.description) for port in host.serial_ports())
    return [SerialPort(node, description, host.may_use(node)) for node, description in sorted(ports)]


def rescan(host: Host) -> int:
    """Rescan the bus of every SCSI card for devices switched on late.

    Returns the number of cards. Raises TransportError without the permission.
    """
    cards = sorted((host.sys / "class/scsi_host").glob("host*/scan"))
    for card in cards:
        try:
            card.write_text(RESCAN)
        except OSError as error:
            hint = f"let the administrator do it: echo '{RESCAN}' | sudo tee {card}"
            raise TransportError(f"cannot search the SCSI bus again: {error.strerror}", hint) from error
    return len(cards)
