"""`planish devices`: the scanners, bridges and serial ports that are plugged in."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from station.options import Debug, Json
from station.telling import faults_told, say

if TYPE_CHECKING:
    from drivers.vivid900.discovery import Host, NameFilter, ScsiDevice, SerialPort, UsbBridge


@dataclass(frozen=True)
class Found:
    """What is plugged in.

    probed  whether devices behind USB bridges were asked, too.
    no_usb  why USB could not be searched, empty when it was.
    """

    scsi: Sequence[ScsiDevice]
    bridges: Sequence[UsbBridge]
    serial: Sequence[SerialPort]
    probed: bool = False
    no_usb: str = ""

    @property
    def scanners(self) -> list[ScsiDevice]:
        """The SCSI devices that are taken for scanners."""
        return [device for device in self.scsi if device.is_scanner]


Vendor = Annotated[str, typer.Option(help="Word in a scanner's vendor name.")]
Product = Annotated[str, typer.Option(help="Word in a scanner's product name.")]
Probe = Annotated[
    bool, typer.Option("--probe", help="Ask behind USB bridges that Linux does not drive. Unmount their disks first.")
]


def search(host: Host, name_filter: NameFilter, *, probe: bool = False) -> Found:
    """Look everywhere. probe: ask behind USB bridges, too."""
    from drivers.scanner import TransportError
    from drivers.vivid900.discovery import find_bridges, find_scsi, find_serial_ports, probe_bridges

    scsi, serial = find_scsi(host, name_filter), find_serial_ports(host)
    try:
        behind = list(probe_bridges(host, name_filter)) if probe else []
        return Found(scsi + behind, find_bridges(host), serial, probed=probe)
    except TransportError as error:
        return Found(scsi, [], serial, no_usb=str(error))


def devices(
    vendor: Vendor = "MINOLTA",
    product: Product = "VIVID",
    probe: Probe = False,
    rescan: Annotated[
        bool, typer.Option("--rescan", help="Let SCSI cards look for devices that were switched on late.")
    ] = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """List scanners, USB-SCSI bridges and serial ports. Nothing but INQUIRY is sent."""
    with faults_told(debug=debug):
        from drivers.vivid900 import discovery

        host = discovery.Host()
        if rescan:
            discovery.rescan(host)
        found = search(host, discovery.NameFilter(vendor, product), probe=probe)
        say(json.dumps(as_data(found)) if as_json else "\n".join(listing(found)))


def listing(found: Found) -> Iterator[str]:
    """Lines for the operator."""
    yield "Scanners"
    yield from _entries(_scanner_line(device) for device in found.scanners)
    yield "Other SCSI devices (not asked anything)"
    yield from _entries(f"{device.where}  {device.identity}" for device in found.scsi if not device.is_scanner)
    yield "USB-SCSI bridges" + (f" (not searched: {found.no_usb})" if found.no_usb else "")
    yield from _entries(f"{bridge}{'  waits for its firmware' * bridge.bridge.sleeping}" for bridge in found.bridges)
    yield "Serial ports"
    yield from _entries(f"{port.node}  {port.description}" for port in found.serial)


def _entries(lines: Iterator[str]) -> Iterator[str]:
    some = False
    for line in lines:
        some = True
        yield f"  {line}"
    if not some:
        yield "  none"


def _scanner_line(device: ScsiDevice) -> str:
    state = f"cannot be used: {device.problem}" if device.problem else "answers"
    return f"{device.where}  {device.identity}  {state}"


def as_data(found: Found) -> dict[str, Any]:
    """The same for programs."""
    return {
        "scanners": [_scsi_data(device) for device in found.scanners],
        "other_scsi": [_scsi_data(device) for device in found.scsi if not device.is_scanner],
        "bridges": [
            {
                "vendor_id": f"{bridge.vendor:04x}",
                "product_id": f"{bridge.product:04x}",
                "name": bridge.bridge.name,
                "needs_firmware": bridge.bridge.sleeping,
                "node": str(bridge.node),
                "usable": bridge.usable,
            }
            for bridge in found.bridges
        ],
        "serial_ports": [
            {"node": str(port.node), "description": port.description, "usable": port.usable} for port in found.serial
        ],
        "usb_problem": found.no_usb,
    }


def _scsi_data(device: ScsiDevice) -> dict[str, Any]:
    identity = device.identity
    return {
        "where": device.where,
        "vendor": identity.vendor,
        "product": identity.product,
        "revision": identity.revision,
        "device_type": identity.device_type,
        "problem": device.problem,
        "hint": device.hint,
    }
