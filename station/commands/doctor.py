"""`planish doctor`: checks of the requirements of a scan, each with a remedy."""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from station.commands.devices import ConnectedDevices, Probe, Product, Vendor, find_connected
from station.commands.options import Debug, Json
from station.commands.terminal import print_result, report_faults

if TYPE_CHECKING:
    from drivers.vivid900.discovery import Host, NameFilter
    from restore.runtime import SystemLibrary

PROBLEM_CODE = 4  # a device cannot be used

RULES = Path("/etc/udev/rules.d/60-planish.rules")  # before 73-seat-late.rules, which acts on the tag
RELOAD = "sudo udevadm control --reload && sudo udevadm trigger"
FIRMWARE = "start it with xchange-fw and the firmware of Adaptec's driver: see docs/how-to/connect-a-vivid-900.md"
LATE = (
    "switch the scanner on, remove the laser barrier and press a key; then: sudo planish devices --rescan "
    "(cabling and SCSI IDs: docs/how-to/connect-a-vivid-900.md)"
)
PROBE = "it may be behind the USB bridge: planish doctor --probe asks there (unmount disks behind it first)"
INSTALL = "sudo apt install"
OCR_PACKAGE = "tesseract-ocr"


State = Literal["ok", "problem", "optional"]


@dataclass(frozen=True)
class Check:
    """Result of one check.

    state  "ok", "problem" for what a scan needs, "optional" for what only some work needs.
    hint   remedy, where it is not ok.
    """

    name: str
    state: State
    message: str
    hint: str = ""


Languages = Callable[[], Sequence[str] | None]
"""Returns the languages that Tesseract has data for, None when it is not installed."""


def run_checks(
    host: Host,
    name_filter: NameFilter,
    languages: Languages,
    missing: Sequence[SystemLibrary] = (),
    *,
    probe: bool = False,
) -> list[Check]:
    """Results of all checks, in the order in which the operator should go through them.

    A scanner that answers over one way needs no other: what is missing of those is optional.
    missing  libraries that the system lacks.
    probe    query devices behind USB bridges, too.
    """
    connected = find_connected(host, name_filter, probe=probe)
    needed: State = "optional" if connected.reached else "problem"
    return [
        *_libraries(missing),
        _libusb(connected, needed),
        _scsi_driver(host, needed),
        *_scanners(connected, name_filter, needed),
        *_bridges(connected, needed),
        *_serial_ports(connected),
        _tesseract(languages()),
    ]


def _libraries(missing: Sequence[SystemLibrary]) -> Iterator[Check]:
    from restore.runtime import SYSTEM_LIBRARIES

    for library in SYSTEM_LIBRARIES:
        if library in missing:
            state: State = "problem" if library.always else "optional"
            message = f"not installed: {library.module} needs it for {library.work}"
            yield Check(library.file, state, message, f"{INSTALL} {library.package}")
        else:
            yield Check(library.file, "ok", f"{library.module} finds it")


def _libusb(connected: ConnectedDevices, needed: State) -> Check:
    if connected.usb_error:
        hint = "pip install --force-reinstall libusb-package"
        return Check("libusb", needed, connected.usb_error, hint)
    return Check("libusb", "ok", "USB bridges can be searched and used")


def _scsi_driver(host: Host, needed: State) -> Check:
    if host.scsi_generic.is_dir():
        return Check("sg", "ok", "the kernel's generic SCSI driver is loaded")
    hint = "sudo modprobe sg && echo sg | sudo tee /etc/modules-load.d/sg.conf"
    return Check("sg", needed, "the kernel's generic SCSI driver (sg) is not loaded", hint)


def _scanners(connected: ConnectedDevices, name_filter: NameFilter, needed: State) -> Iterator[Check]:
    for scanner in connected.scanners:
        label = f"{scanner.identity} at {scanner.where}"
        if not scanner.problem:
            yield Check("scanner", "ok", f"{label} answers")
        else:
            hint = _add_rule(scsi_rule(name_filter)) if "udev" in scanner.hint else scanner.hint
            yield Check("scanner", needed, f"{label}: {scanner.problem}", hint)
    if not connected.scanners:
        yield Check("scanner", "problem", "no scanner was found", PROBE if _has_unprobed_bridge(connected) else LATE)


def _has_unprobed_bridge(connected: ConnectedDevices) -> bool:
    """Return whether a usable bridge was not probed.

    Devices behind Adaptec's bridges get no nodes from the kernel.
    """
    ready = any(bridge.usable and not bridge.bridge.sleeping for bridge in connected.bridges)
    return ready and not connected.probed


def _bridges(connected: ConnectedDevices, needed: State) -> Iterator[Check]:
    for bridge in connected.bridges:
        if bridge.bridge.sleeping:
            yield Check("bridge", needed, f"{bridge} waits for its firmware", FIRMWARE)
        elif bridge.usable:
            yield Check("bridge", "ok", str(bridge))
        else:
            rule = usb_rule(bridge.vendor, bridge.product)
            yield Check("bridge", needed, f"you may not use {bridge}", _add_rule(rule))
    if all(bridge.usable for bridge in connected.bridges):
        for device in connected.unusable_bridges:
            yield Check("bridge", needed, f"{device.where}: {device.problem}", device.hint)


def _serial_ports(connected: ConnectedDevices) -> Iterator[Check]:
    for port in connected.serial:
        if port.usable:
            yield Check("serial port", "ok", f"{port.node} {port.description}")
        else:
            group = _group_of(port.node)
            hint = f"sudo usermod -aG {group} $USER, then log out and in again"
            yield Check("serial port", "optional", f"you may not open {port.node}: only a turntable needs it", hint)
    if not connected.serial:
        yield Check("serial port", "optional", "no serial port: only a turntable needs one")


def _tesseract(languages: Sequence[str] | None) -> Check:
    install = f"{INSTALL} {OCR_PACKAGE}"
    if languages is None:
        return Check("tesseract", "optional", "tesseract is not installed: pages cannot be read", install)
    if not languages:
        return Check("tesseract", "optional", "tesseract knows no language", f"{install}-eng")
    return Check("tesseract", "ok", f"tesseract reads {', '.join(languages)} (more: {install}-<language>)")


def check_scanner(config: Mapping[str, Any]) -> Check:
    """Open the scanner of a table `[scanner]` that is not a Vivid 900, and close it."""
    from drivers import ScannerError, open_scanner

    try:
        with open_scanner(config) as scanner:
            return Check("scanner", "ok", f"{getattr(scanner, 'identity', config['driver'])} answers")
    except ScannerError as error:
        return Check("scanner", "problem", str(error), error.hint)


def check_calibration(config: Path, today: date) -> Check:
    """Check the calibration that a configuration names.

    Raises UsageError or SettingsError for a file that cannot be read.
    """
    from drivers.vivid900.geometry.calibration import read_calibration
    from station.config import load_config
    from station.verdict.calibration_notes import CALIBRATE, NOMINAL_TEXT, OLD_DAYS, age_days

    path = load_config(config).scanner.get("calibration")
    if path is None:
        return Check("calibration", "optional", NOMINAL_TEXT, CALIBRATE)
    measured = read_calibration(Path(path)).measured
    if measured is None:
        return Check("calibration", "optional", f"{path} does not say when it was measured", CALIBRATE)
    message = (
        f"measured on {measured.date} from {measured.captures} captures; points are off by "
        f"{measured.expected_mm:.2f} mm at most (one standard deviation)"
    )
    old = age_days(measured.date, today) > OLD_DAYS
    return Check("calibration", "optional" if old else "ok", message, CALIBRATE)


def scsi_rule(name_filter: NameFilter) -> str:
    """Return the udev rule that opens the scanner's node to local users.

    They are those who sit at the computer.
    """
    names = f'ATTRS{{vendor}}=="*{name_filter.vendor}*", ATTRS{{model}}=="*{name_filter.product}*"'
    return f'SUBSYSTEM=="scsi_generic", {names}, TAG+="uaccess"'


def usb_rule(vendor: int, product: int) -> str:
    """Return the udev rule that opens a bridge to local users.

    They are those who sit at the computer.
    """
    return f'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{vendor:04x}", ATTR{{idProduct}}=="{product:04x}", TAG+="uaccess"'


def _add_rule(rule: str) -> str:
    return f"echo {shlex.quote(rule)} | sudo tee -a {RULES} && {RELOAD}"


def _group_of(node: Path) -> str:
    """Return the group that a serial port belongs to.

    Debian's name for it where that cannot be seen.
    """
    try:
        return node.group()
    except (OSError, KeyError, NotImplementedError):
        return "dialout"


def tesseract_languages() -> Sequence[str] | None:
    """Languages of the installed Tesseract, None when it is not installed."""
    program = shutil.which("tesseract")
    if program is None:
        return None
    listed = subprocess.run([program, "--list-langs"], capture_output=True, text=True, check=False)
    return listed.stdout.splitlines()[1:]  # the first line is a heading


def missing_libraries() -> Sequence[SystemLibrary]:
    """The native libraries that this computer lacks."""
    from restore import runtime

    return runtime.missing_libraries()


def missing_packages(missing: Sequence[SystemLibrary]) -> list[str]:
    """Return Debian's names of the packages of missing libraries.

    Each once, in their order.
    """
    return list(dict.fromkeys(library.package for library in missing))


def doctor(
    vendor: Vendor = "MINOLTA",
    product: Product = "VIVID",
    probe: Probe = False,
    config: Annotated[
        Path | None, typer.Option(help="Configuration whose scanner or calibration is checked.", show_default=False)
    ] = None,
    packages: Annotated[
        bool, typer.Option("--packages", help="Print only the Debian packages of missing libraries.")
    ] = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Check what is installed and connected, with fixes."""
    with report_faults(debug=debug):
        if packages:
            for package in missing_packages(missing_libraries()):
                print_result(package)
            raise typer.Exit
        from drivers import driver_of
        from drivers.vivid900.discovery import Host, NameFilter
        from station.config import load_config

        table = None if config is None else load_config(config).scanner
        if table is not None and "calibration" not in driver_of(table).facts:
            checks = [*_libraries(missing_libraries()), check_scanner(table), _tesseract(tesseract_languages())]
        else:
            names = NameFilter(vendor, product)
            checks = run_checks(Host(), names, tesseract_languages, missing_libraries(), probe=probe)
            if config is not None:
                checks.append(check_calibration(config, date.today()))
        print_result(json.dumps([asdict(check) for check in checks]) if as_json else "\n".join(format_report(checks)))
    if any(check.state == "problem" for check in checks):
        raise typer.Exit(PROBLEM_CODE)


def format_report(checks: Sequence[Check]) -> Iterator[str]:
    """Lines for the operator: the state of each check, and below it the remedy."""
    marks = {"ok": "ok      ", "problem": "MISSING ", "optional": "optional"}
    for check in checks:
        yield f"{marks[check.state]}  {check.name}: {check.message}"
        if check.hint and check.state != "ok":
            yield f"            {check.hint}"
