"""`planish devices` and `planish doctor` over computers with this and that missing."""

from __future__ import annotations

import errno
import json
import os
from dataclasses import replace
from datetime import date
from pathlib import Path
from types import SimpleNamespace

import pytest
import usb.core

from drivers.scanner import TransportError
from drivers.scsi.bridges import BRIDGES
from drivers.scsi.commands import Identity
from drivers.scsi.sg import SgDevice
from drivers.scsi.transport import GOOD, Reply
from drivers.vivid900 import discovery
from drivers.vivid900.discovery import Host, NameFilter
from drivers.vivid900.geometry.calibration import Measurement, encode_calibration
from oracles.hidden_body import HIDDEN_BODY
from oracles.simulation.buses.sg_node import SimulatedSgNode
from oracles.simulation.buses.usb_bridge import SimulatedBridge
from restore.runtime.native import SYSTEM_LIBRARIES
from station.cli import main
from station.commands import doctor
from station.commands.doctor import check_calibration, run_checks

VIVID = Identity(6, "MINOLTA", "VIVID 900", "1.00")
USB2XCHANGE, ASLEEP = (0x03F3, 0x2003), (0x03F3, 0x2002)


class Scanner:
    def execute(self, cdb, data_out, data_in_length) -> Reply:
        return Reply(GOOD, VIVID.build()[:data_in_length])


@pytest.fixture
def whole(tmp_path) -> Host:
    """A computer that has everything: a scanner at /dev/sg0, a bridge, a serial port."""
    device = tmp_path / "sys/class/scsi_generic/sg0/device"
    device.mkdir(parents=True)
    for file, text in {"vendor": "MINOLTA ", "model": "VIVID 900", "rev": "1.00", "type": "6"}.items():
        (device / file).write_text(text)
    return Host(
        sys=tmp_path / "sys",
        dev=Path("/dev"),
        open_sg=lambda node: SimulatedSgNode(Scanner()).connect(),
        usb_devices=lambda: [usb.core.find(backend=SimulatedBridge(Scanner()))],
        serial_ports=lambda: [SimpleNamespace(device="/dev/ttyUSB0", description="FT232R")],
        may_use=lambda node: True,
    )


@pytest.fixture
def bare(whole, tmp_path) -> Host:
    return replace(whole, sys=tmp_path / "empty", usb_devices=lambda: [], serial_ports=lambda: [])


@pytest.fixture
def this_computer(monkeypatch):
    """Let the commands see another computer than this one."""

    def pretend(host: Host) -> None:
        monkeypatch.setattr(discovery, "Host", lambda: host)
        monkeypatch.setattr(doctor, "tesseract_languages", lambda: ["eng"])
        monkeypatch.setattr(doctor, "missing_libraries", lambda: ())

    return pretend


def checks_of(host: Host, languages=("eng",), **options):
    return {check.name: check for check in run_checks(host, NameFilter(), lambda: languages, **options)}


def may_not(host: Host, part: str) -> Host:
    return replace(host, may_use=lambda node: part not in str(node))


def test_everything_is_there(whole, this_computer, capsys):
    this_computer(whole)
    assert main(["doctor"]) == 0
    assert "MISSING" not in capsys.readouterr().out
    assert {check.state for check in checks_of(whole).values()} == {"ok"}


def test_a_bare_computer_is_shown_where_to_begin(bare, this_computer, capsys):
    this_computer(bare)
    assert main(["doctor", "--json"]) == 4
    reported = {check["name"]: check for check in json.loads(capsys.readouterr().out)}
    assert {name for name, check in reported.items() if check["state"] == "problem"} == {"sg", "scanner"}
    assert "modprobe sg" in reported["sg"]["hint"]
    assert "laser barrier" in reported["scanner"]["hint"]
    assert reported["serial port"]["state"] == "optional"


def test_every_problem_says_what_to_do_now(bare, whole):
    hosts = [bare, may_not(whole, "tty"), may_not(whole, "bus/usb"), may_not(bare, "")]
    for host in hosts:
        for check in checks_of(host, languages=None).values():
            assert check.hint or check.state == "ok" or check.name == "serial port"


def test_the_rule_for_a_scanner_that_may_not_be_opened(whole):
    def refuse(node, flags):
        raise PermissionError(13, "Permission denied")

    scanner = checks_of(replace(whole, open_sg=lambda node: SgDevice(node, open_node=refuse)))["scanner"]
    assert scanner.state == "problem"
    rule = 'SUBSYSTEM=="scsi_generic", ATTRS{vendor}=="*MINOLTA*", ATTRS{model}=="*VIVID*", TAG+="uaccess"'
    assert rule in scanner.hint
    assert "/etc/udev/rules.d/60-planish.rules" in scanner.hint


def test_the_rule_for_a_bridge_that_may_not_be_used(whole, bare):
    rule = 'SUBSYSTEM=="usb", ATTR{idVendor}=="07af", ATTR{idProduct}=="0005", TAG+="uaccess"'
    alone = may_not(replace(bare, usb_devices=whole.usb_devices), "bus/usb")
    assert checks_of(alone)["bridge"].state == "problem"
    assert rule in checks_of(alone)["bridge"].hint
    assert checks_of(may_not(whole, "bus/usb"))["bridge"].state == "optional"  # the kernel reaches the scanner


def test_a_bridge_without_firmware(bare):
    host = replace(bare, usb_devices=lambda: [usb.core.find(backend=SimulatedBridge(Scanner(), numbers=ASLEEP))])
    assert checks_of(host)["bridge"].state == "problem"
    assert "firmware" in checks_of(host)["bridge"].message


def test_a_scanner_behind_a_bridge_that_the_kernel_does_not_know(bare):
    def bridges():
        return [usb.core.find(backend=SimulatedBridge(Scanner(), numbers=USB2XCHANGE))]

    host = replace(bare, usb_devices=bridges)
    assert "--probe" in checks_of(host)["scanner"].hint
    assert checks_of(host, probe=True)["scanner"].state == "ok"


def test_no_libusb(whole, bare):
    def broken():
        raise TransportError("libusb cannot be loaded", "install it")

    check = checks_of(replace(bare, usb_devices=broken))["libusb"]
    assert check.state == "problem"
    assert "libusb-package" in check.hint
    assert checks_of(replace(whole, usb_devices=broken))["libusb"].state == "optional"  # the kernel reaches the scanner


def test_a_serial_port_that_may_not_be_opened(whole):
    check = checks_of(may_not(whole, "tty"))["serial port"]
    assert check.state == "optional"
    assert "usermod -aG" in check.hint


def test_one_way_that_works_is_enough(whole, this_computer, capsys):
    """The node of the kernel refuses, the bridge answers: nothing needed is missing."""

    def refuse(node, flags):
        raise PermissionError(13, "Permission denied")

    host = may_not(replace(whole, open_sg=lambda node: SgDevice(node, open_node=refuse)), "tty")
    this_computer(host)
    assert main(["doctor"]) == 4
    capsys.readouterr()
    assert main(["doctor", "--probe"]) == 0
    out, err = capsys.readouterr()
    assert "MISSING" not in out
    assert "optional  scanner: MINOLTA VIVID 900 1.00 at /dev/sg0: cannot open" in out
    assert "ok        scanner: MINOLTA VIVID 900 1.00 at Microtech" in out
    assert "SCSI ID 5" in err
    this_computer(replace(host, sys=host.sys / "nothing"))  # no kernel driver at all
    assert main(["doctor", "--probe"]) == 0


def refused_bridge(error: int) -> SimulatedBridge:
    bridge = SimulatedBridge(Scanner())

    def refuse(*_arguments):
        raise usb.core.USBError(os.strerror(error), None, error)

    bridge.open_device = refuse
    return bridge


def test_a_bridge_that_may_not_be_used_is_reported_by_devices(bare, this_computer, capsys):
    bridge = refused_bridge(errno.EACCES)
    host = may_not(replace(bare, usb_devices=lambda: [usb.core.find(backend=bridge)]), "bus/usb")
    this_computer(host)
    assert main(["devices"]) == 0
    assert "you may not use it" in capsys.readouterr().out
    assert main(["devices", "--probe"]) == 0
    out, _ = capsys.readouterr()
    assert "cannot be queried: cannot open the bridge: Permission denied" in out
    assert "udev rule" in out
    assert main(["devices", "--probe", "--json"]) == 0
    (reported,) = json.loads(capsys.readouterr().out)["unusable_bridges"]
    assert "Permission denied" in reported["problem"]
    assert [
        check.state for check in run_checks(host, NameFilter(), lambda: [], probe=True) if check.name == "bridge"
    ] == ["problem"]


def test_a_bridge_that_another_program_holds_is_reported_by_doctor(bare):
    bridge = refused_bridge(errno.EBUSY)
    host = replace(bare, usb_devices=lambda: [usb.core.find(backend=bridge)])
    states = {
        check.state: check for check in run_checks(host, NameFilter(), lambda: [], probe=True) if check.name == "bridge"
    }
    assert "another program" in states["problem"].hint


def test_probing_names_every_scsi_id_before_it_waits_for_it(bare, this_computer, capsys):
    this_computer(replace(bare, usb_devices=lambda: [usb.core.find(backend=SimulatedBridge(Scanner(), scsi_id=3))]))
    assert main(["devices", "--probe"]) == 0
    err = capsys.readouterr().err.splitlines()
    assert err == [f"asking Microtech USB-SCSI-HD50 (XpressSCSI), SCSI ID {target}" for target in range(7)]


@pytest.mark.parametrize(
    ("languages", "state", "hint"),
    [
        (None, "optional", "apt install tesseract-ocr"),
        ([], "optional", "tesseract-ocr-eng"),
        (["eng", "deu"], "ok", ""),
    ],
)
def test_the_reader_of_words_is_not_a_device(whole, languages, state, hint):
    check = checks_of(whole, languages)["tesseract"]
    assert (check.state, hint in check.hint) == (state, True)


def test_libraries_that_the_system_lacks_are_named_with_their_packages(bare):
    checks = {check.name: check for check in run_checks(bare, NameFilter(), lambda: ["eng"], SYSTEM_LIBRARIES)}
    for library in SYSTEM_LIBRARIES:
        assert checks[library.file].hint == f"sudo apt install {library.package}"
    states = [checks[library.file].state for library in SYSTEM_LIBRARIES]
    assert states == ["optional", "problem", "problem"]  # stored scans are restored without open3d


def test_packages_for_apt_and_nothing_else(bare, this_computer, capsys, monkeypatch):
    this_computer(bare)
    assert main(["doctor", "--packages"]) == 0
    assert capsys.readouterr().out == ""
    monkeypatch.setattr(doctor, "missing_libraries", lambda: SYSTEM_LIBRARIES)
    assert main(["doctor", "--packages"]) == 0
    assert capsys.readouterr().out.split() == ["libegl1", "libgl1", "libopengl0"]


def test_devices_are_listed(whole, this_computer, capsys):
    this_computer(whole)
    assert main(["devices"]) == 0
    out = capsys.readouterr().out
    for reported in ("/dev/sg0  MINOLTA VIVID 900 1.00  answers", "07af:0005 Microtech", "/dev/ttyUSB0  FT232R"):
        assert reported in out


def test_devices_as_json(whole, this_computer, capsys):
    this_computer(whole)
    assert main(["devices", "--json", "--probe"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert [scanner["where"] for scanner in reported["scanners"]] == [
        "/dev/sg0", "Microtech USB-SCSI-HD50 (XpressSCSI), SCSI ID 5",
    ]  # fmt: skip
    assert reported["bridges"][0]["product_id"] == "0005"
    assert reported["serial_ports"][0]["node"] == "/dev/ttyUSB0"


def test_a_computer_without_devices_is_not_an_error(bare, this_computer, capsys):
    this_computer(bare)
    assert main(["devices", "--rescan"]) == 0
    assert capsys.readouterr().out.count("none") == 4


def test_the_name_of_a_scanner_is_shown(whole, this_computer, capsys):
    this_computer(whole)
    assert main(["devices", "--json", "--vendor", "PLANISH"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["scanners"] == []
    assert len(reported["other_scsi"]) == 1


def test_the_rules_that_are_bundled_are_those_that_doctor_asks_for(repository):
    lines = (repository / "configs/60-planish.rules").read_text().splitlines()
    rules = {line for line in lines if line and not line.startswith("#")}
    assert rules == {doctor.scsi_rule(NameFilter()), *(doctor.usb_rule(*numbers) for numbers in BRIDGES)}


@pytest.mark.parametrize(
    ("measured", "state", "words"),
    [
        (None, "optional", "does not say when"),
        (Measurement("2026-01-31", 12, 0.15, 0.02), "ok", "2026-01-31 from 12 captures"),
        (Measurement("2024-01-31", 12, 0.15, 0.02), "optional", "2024-01-31"),
    ],
)
def test_the_doctor_shows_how_old_a_calibration_is(tmp_path, measured, state, words):
    (tmp_path / "body.toml").write_text(encode_calibration(replace(HIDDEN_BODY, measured=measured)), "utf-8")
    config = tmp_path / "station.toml"
    config.write_text('[scanner]\ndriver = "simulated"\ncalibration = "body.toml"\n', "utf-8")
    check = check_calibration(config, date(2026, 6, 1))
    assert (check.state, words in check.message) == (state, True)


def test_the_doctor_names_a_scanner_that_is_not_calibrated(tmp_path):
    config = tmp_path / "station.toml"
    config.write_text('[scanner]\ndriver = "simulated"\n', "utf-8")
    check = check_calibration(config, date(2026, 6, 1))
    assert (check.state, check.message.startswith("nominal")) == ("optional", True)
