"""Discovery over a made-up /sys and simulated buses: what it finds, and that it does no harm."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import usb.core

from drivers.scanner import TransportError
from drivers.scsi.commands import INQUIRY, Identity
from drivers.scsi.sg import SgDevice
from drivers.scsi.transport import GOOD, Reply
from drivers.vivid900.discovery import (
    PROBE_S,
    Host,
    NameFilter,
    find_bridges,
    find_scsi,
    find_serial_ports,
    probe_bridges,
    rescan,
)
from oracles.simulation.buses.sg_node import FAULTS, SimulatedSgNode
from oracles.simulation.buses.usb_bridge import SimulatedBridge

VIVID = Identity(6, "MINOLTA", "VIVID 900", "1.00")
DISK = Identity(0, "ATA", "SOME DISK", "2.00")


class Scanner:
    """A device that notes every command."""

    def __init__(self, identity: Identity = VIVID) -> None:
        self.identity, self.commands = identity, []

    def execute(self, cdb: bytes, data_out: bytes, data_in_length: int) -> Reply:
        self.commands.append(cdb)
        return Reply(GOOD, self.identity.build()[:data_in_length])


def absent(path: Path):
    raise AssertionError(f"{path} was opened")


@pytest.fixture
def host(tmp_path) -> Host:
    return Host(
        sys=tmp_path / "sys",
        dev=tmp_path / "dev",
        open_sg=absent,
        usb_devices=lambda: [],
        serial_ports=lambda: [],
        may_use=lambda node: True,
    )


def add_node(host: Host, name: str, identity: Identity) -> None:
    device = host.scsi_generic / name / "device"
    device.mkdir(parents=True)
    names = {"vendor": identity.vendor.ljust(8), "model": identity.product.ljust(16), "rev": identity.revision}
    for file, text in {**names, "type": str(identity.device_type)}.items():
        (device / file).write_text(text + "\n")


def over(target) -> SgDevice:
    return SimulatedSgNode(target).connect()


def usb_host(host: Host, *bridges: SimulatedBridge) -> Host:
    return replace(host, usb_devices=lambda: [usb.core.find(backend=bridge) for bridge in bridges])


def test_nothing_is_found_where_nothing_is(host):
    assert find_scsi(host, NameFilter()) == []
    assert find_bridges(host) == []
    assert find_serial_ports(host) == []


def test_a_scanner_is_asked_and_nothing_else_is(host):
    add_node(host, "sg0", DISK)
    add_node(host, "sg10", VIVID)
    add_node(host, "sg2", DISK)
    scanner = Scanner()
    opened = []

    def open_sg(node: Path) -> SgDevice:
        opened.append(node)
        return over(scanner)

    found = find_scsi(replace(host, open_sg=open_sg), NameFilter())
    assert [Path(device.where).name for device in found] == ["sg0", "sg2", "sg10"]
    assert [device.identity for device in found] == [DISK, DISK, VIVID]
    assert [device.is_scanner for device in found] == [False, False, True]
    assert found[2].problem == ""
    assert opened == [host.dev / "sg10"]
    assert [cdb[0] for cdb in scanner.commands] == [INQUIRY]


@pytest.mark.parametrize(
    "name_filter", [NameFilter("minolta", "vivid"), NameFilter("", "900"), NameFilter("KONICA", "VI-9")]
)
def test_the_name_of_a_scanner_is_shown(host, name_filter):
    add_node(host, "sg0", Identity(3, "Konica Minolta"[:6], "VI-900", "1"))
    add_node(host, "sg1", VIVID)
    found = find_scsi(replace(host, open_sg=lambda node: over(Scanner())), name_filter)
    assert [device.is_scanner for device in found] == [name_filter.vendor != "minolta", name_filter.vendor != "KONICA"]


def test_a_scanner_that_may_not_be_opened_is_still_listed(host):
    add_node(host, "sg3", VIVID)

    def refuse(node: Path):
        raise TransportError(f"cannot open {node}: Permission denied", "the udev rule")

    (found,) = find_scsi(replace(host, open_sg=refuse), NameFilter())
    assert found.identity == VIVID
    assert "Permission denied" in found.problem
    assert found.hint == "the udev rule"


def test_a_scanner_that_does_not_answer_is_still_listed(host):
    add_node(host, "sg3", VIVID)
    node = SimulatedSgNode(Scanner(), faults={0: FAULTS["host time-out"]})
    (found,) = find_scsi(replace(host, open_sg=lambda _: node.connect()), NameFilter())
    assert "did not answer" in found.problem


def test_a_node_that_vanishes_while_it_is_read_is_not_a_fault(host):
    (host.scsi_generic / "sg0").mkdir(parents=True)
    (found,) = find_scsi(host, NameFilter())
    assert not found.is_scanner


def test_bridges_by_their_numbers(host):
    asleep = SimulatedBridge(Scanner(), numbers=(0x03F3, 0x2002))
    other = SimulatedBridge(Scanner(), numbers=(0x1234, 0x5678))
    mine = SimulatedBridge(Scanner())
    found = find_bridges(usb_host(host, mine, other, asleep))
    assert [(bridge.vendor, bridge.product) for bridge in found] == [(0x07AF, 0x0005), (0x03F3, 0x2002)]
    assert [bridge.bridge.sleeping for bridge in found] == [False, True]
    assert found[0].node == host.dev / "bus/usb/001/005"
    assert mine.log == []  # not even opened


@pytest.mark.parametrize("numbers", [(0x07AF, 0x0005), (0x03F3, 0x2003)])
def test_behind_bridges_every_scsi_id_but_the_bridges_own_is_asked(host, numbers):
    scanner = Scanner()
    bridge = SimulatedBridge(scanner, numbers=numbers, scsi_id=5)
    (found,) = probe_bridges(usb_host(host, bridge), NameFilter())
    assert found.is_scanner
    assert found.identity == VIVID
    assert "SCSI ID 5" in found.where
    asked = {wrapper.lun for wrapper in bridge.device.wrappers if wrapper.cdb[0] == INQUIRY}
    assert asked == {target << 4 if numbers[0] == 0x07AF else target for target in range(7)}
    assert {cdb[0] for cdb in scanner.commands} == {INQUIRY}
    assert bridge.log[-1] == "close"


def test_sleeping_bridges_are_skipped_and_forbidden_ones_reported(host):
    asleep = SimulatedBridge(Scanner(), numbers=(0x03F3, 0x2002))
    gone = SimulatedBridge(Scanner())
    devices = [usb.core.find(backend=asleep), usb.core.find(backend=gone)]
    gone.unplug()
    (reported,) = probe_bridges(replace(host, usb_devices=lambda: devices), NameFilter())
    assert not reported.is_scanner
    assert "cannot open the bridge" in reported.problem
    assert reported.hint


def test_a_scsi_id_without_an_answer_takes_little_time(host):
    """A bridge that waits for the device as long as the host does: INQUIRY is answered at once or not at all."""

    class Silent(Scanner):
        def execute(self, cdb, data_out, data_in_length):
            raise TransportError("no device answers")

    waits = []
    bridge = SimulatedBridge(Silent(), sleep=waits.append)
    assert list(probe_bridges(usb_host(host, bridge), NameFilter())) == []
    assert len(waits) == 1  # the other IDs are refused by the bridge
    assert max(waits) <= PROBE_S


def test_serial_ports(host):
    ports = [
        SimpleNamespace(device="/dev/ttyUSB1", description="FT232R"),
        SimpleNamespace(device="/dev/ttyUSB0", description="n/a"),
    ]
    allowed = replace(host, serial_ports=lambda: ports, may_use=lambda node: node.name == "ttyUSB1")
    assert [(str(p.node), p.usable) for p in find_serial_ports(allowed)] == [
        ("/dev/ttyUSB0", False),
        ("/dev/ttyUSB1", True),
    ]


def test_the_bus_can_be_searched_again(host):
    for number in (0, 1):
        card = host.sys / f"class/scsi_host/host{number}"
        card.mkdir(parents=True)
        (card / "scan").touch()
    assert rescan(host) == 2
    assert (host.sys / "class/scsi_host/host1/scan").read_text() == "- - -"


def test_a_user_without_permission_to_rescan_is_shown_who_has_it(host):
    (host.sys / "class/scsi_host/host0/scan").mkdir(parents=True)  # a folder refuses to be written, root or not
    with pytest.raises(TransportError) as caught:
        rescan(host)
    assert "sudo tee" in caught.value.hint
