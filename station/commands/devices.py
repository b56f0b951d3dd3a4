"""`planish devices`: the scanners, bridges and serial ports that are plugged in."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from station.commands.options import Debug, Json
from station.commands.terminal import print_note, print_result, report_faults

if TYPE_CHECKING:
    from drivers.vivid900.discovery import Host, NameFilter, ScsiDevice, SerialPort, UsbBridge


@dataclass(frozen=True)
class ConnectedDevices:
    """Connected devices.

    probed     True when devices behind USB bridges were queried, too.
    usb_error  reason for which USB could not be searched; empty when it was.
    """

    scsi: Sequence[ScsiDevice]
    bridges: Sequence[UsbBridge]
    serial: Sequence[SerialPort]
    probed: bool = False
    usb_error: str = ""

    @property
    def scanners(self) -> list[ScsiDevice]:
        """The SCSI devices that match the scanner's names."""
        return [device for device in self.scsi if device.is_scanner]

    @property
    def reached(self) -> bool:
        """Whether a scanner answers."""
        return any(not scanner.problem for scanner in self.scanners)

    @property
    def others(self) -> list[ScsiDevice]:
        """The SCSI devices with other names."""
        return [device for device in self.scsi if not device.is_scanner and not device.problem]

    @property
    def unusable_bridges(self) -> list[ScsiDevice]:
        """The bridges that could not be probed, each with its problem."""
        return [device for device in self.scsi if not device.is_scanner and device.problem]


Vendor = Annotated[str, typer.Option(help="Word in the vendor name of the scanner.")]
Product = Annotated[str, typer.Option(help="Word in the product name of the scanner.")]
Probe = Annotated[bool, typer.Option("--probe", help="Query devices behind USB bridges; unmount their disks first.")]


def find_connected(
    host: Host, name_filter: NameFilter, *, probe: bool = False, report: Callable[[str], None] = print_note
) -> ConnectedDevices:
    """Search SCSI, USB and serial ports.

    probe: query devices behind USB bridges, too, and report each.
    """
    from drivers.scanner import TransportError
    from drivers.vivid900.discovery import find_bridges, find_scsi, find_serial_ports, probe_bridges

    scsi, serial = find_scsi(host, name_filter), find_serial_ports(host)
    try:
        behind = list(probe_bridges(host, name_filter, report)) if probe else []
        return ConnectedDevices(scsi + behind, find_bridges(host), serial, probed=probe)
    except TransportError as error:
        return ConnectedDevices(scsi, [], serial, usb_error=str(error))


def devices(
    vendor: Vendor = "MINOLTA",
    product: Product = "VIVID",
    probe: Probe = False,
    rescan: Annotated[
        bool, typer.Option("--rescan", help="Let SCSI cards search for devices switched on late.")
    ] = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """List scanners, USB-SCSI bridges and serial ports.

    Only INQUIRY is sent.
    """
    with report_faults(debug=debug):
        from drivers.vivid900 import discovery

        host = discovery.Host()
        if rescan:
            discovery.rescan(host)
        connected = find_connected(host, discovery.NameFilter(vendor, product), probe=probe)
        print_result(json.dumps(as_data(connected)) if as_json else "\n".join(format_listing(connected)))


def format_listing(connected: ConnectedDevices) -> Iterator[str]:
    """Lines of the listing for the operator."""
    yield "Scanners"
    yield from _entries(_scanner_line(device) for device in connected.scanners)
    yield "Other SCSI devices (not queried)" if not connected.probed else "Other SCSI devices"
    yield from _entries(f"{device.where}  {device.identity}" for device in connected.others)
    yield "USB-SCSI bridges" + (f" (not searched: {connected.usb_error})" if connected.usb_error else "")
    yield from _entries(_bridge_line(bridge) for bridge in connected.bridges)
    for device in connected.unusable_bridges:
        yield f"  {device.where} cannot be queried: {device.problem}"
        yield f"      {device.hint}"
    yield "Serial ports"
    yield from _entries(f"{port.node}  {port.description}" for port in connected.serial)


def _entries(lines: Iterator[str]) -> Iterator[str]:
    some = False
    for line in lines:
        some = True
        yield f"  {line}"
    if not some:
        yield "  none"


def _bridge_line(bridge: UsbBridge) -> str:
    if bridge.bridge.sleeping:
        return f"{bridge}  waits for its firmware"
    return str(bridge) if bridge.usable else f"{bridge}  you may not use it: planish doctor shows the udev rule to add"


def _scanner_line(device: ScsiDevice) -> str:
    state = f"cannot be used: {device.problem}" if device.problem else "answers"
    return f"{device.where}  {device.identity}  {state}"


def as_data(connected: ConnectedDevices) -> dict[str, Any]:
    """The listing as JSON values."""
    return {
        "scanners": [_scsi_data(device) for device in connected.scanners],
        "other_scsi": [_scsi_data(device) for device in connected.others],
        "unusable_bridges": [
            {"name": device.where, "problem": device.problem, "hint": device.hint}
            for device in connected.unusable_bridges
        ],
        "bridges": [
            {
                "vendor_id": f"{bridge.vendor:04x}",
                "product_id": f"{bridge.product:04x}",
                "name": bridge.bridge.name,
                "needs_firmware": bridge.bridge.sleeping,
                "node": str(bridge.node),
                "usable": bridge.usable,
            }
            for bridge in connected.bridges
        ],
        "serial_ports": [
            {"node": str(port.node), "description": port.description, "usable": port.usable}
            for port in connected.serial
        ],
        "usb_problem": connected.usb_error,
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
