"""USB Bulk-Only below the driver: every fault of the bus, and what becomes of the bridge after it."""

from __future__ import annotations

import errno
import itertools
import subprocess
import sys

import pytest
import usb.core

from drivers.scanner import SettingsError, TransportError
from drivers.scsi import usb as usb_transport
from drivers.scsi.bulk_exchange import NoSuchTarget
from drivers.scsi.sense import Key, Sense
from drivers.scsi.transport import CHECK_CONDITION, GOOD, Reply
from drivers.scsi.usb import UsbBulkOnly, find_device
from oracles.simulation.buses.bulk_only_device import FAULTS
from oracles.simulation.buses.usb_bridge import MICROTECH, SimulatedBridge

USB2XCHANGE, USB2XCHANGE_ASLEEP, UNKNOWN = (0x03F3, 0x2003), (0x03F3, 0x2002), (0x1234, 0x5678)

# After these the bridge's answer is still whole, or its loss is detected from the status.
HARMLESS = {"stall status", "status in place of data", "stall data", "short data", "duplicate status"}


@pytest.fixture
def connect():
    """Open a bridge; closed at the end of the test."""
    opened = []

    def connect(bridge: SimulatedBridge, **options) -> UsbBulkOnly:
        device = next(usb.core.find(find_all=True, backend=bridge))
        opened.append(UsbBulkOnly(device, **{"target": 5, **options}))
        return opened[-1]

    yield connect
    for transport in opened:
        transport.close()


def commands(device):
    return {
        "read": device.reading(200),
        "read whole packets": device.reading(128),
        "write": (bytes([device.WRITE] + 5 * [0]), b"some parameters"),
        "no data": (bytes(6),),
        "fail": (bytes([device.FAIL, 0, Key.HARDWARE_ERROR, 0x44, 0, 0]),),
    }


@pytest.mark.parametrize("name", ("read", "read whole packets", "write", "no data", "fail"))
@pytest.mark.parametrize("fault", [fault for fault in FAULTS if fault != "disconnect"])
def test_after_every_fault_the_next_command_works(connect, device, fault, name):
    """Single faults: a declared error or the right answer, never a wrong one, and the bridge is usable again."""
    command = commands(device)[name]
    right = UsbBulkOnly.execute(connect(SimulatedBridge(device)), *command)
    bridge = SimulatedBridge(device, faults={0: fault})
    transport = connect(bridge)
    try:
        reply = transport.execute(*command)
    except TransportError as error:
        assert error.hint
    else:
        assert fault in HARMLESS or name == "write" or not command[2:]
        assert reply.data == right.data[: len(reply.data)]  # what came is the device's, if not all of it
    assert transport.execute(*device.reading(200)) == Reply(GOOD, device.memory[:200])
    assert transport.execute(*command) == right


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_in_autosense_is_reported(connect, device, fault):
    transport = connect(SimulatedBridge(device, faults={1: fault}))
    try:
        reply = transport.execute(bytes([device.FAIL, 0, Key.HARDWARE_ERROR, 0x44, 0, 0]))
    except TransportError:
        return
    assert reply.status == CHECK_CONDITION
    whole = Sense(Key.HARDWARE_ERROR, 0x44).build()
    assert reply.sense == whole[: len(reply.sense)]


@pytest.mark.parametrize(
    ("first", "second"), [*itertools.product(("no answer", "phase error", "refuse command"), FAULTS)]
)
def test_a_fault_right_after_a_fault(connect, device, first, second):
    bridge = SimulatedBridge(device, faults={0: first, 1: second})
    transport = connect(bridge)
    for _ in range(2):
        try:
            transport.execute(*device.reading(200))
        except TransportError:
            bridge.plug()
    assert transport.execute(*device.reading(200)) == Reply(GOOD, device.memory[:200])


def test_a_stall_in_the_data_keeps_what_came_before_it(connect, device):
    """A device that stops after whole packets halts the pipe: only the residue gives the number of bytes."""
    device.memory = device.memory[:128]
    assert connect(SimulatedBridge(device)).execute(*device.reading(4096)) == Reply(GOOD, device.memory)


def test_a_bridge_that_refuses_reset_recovery_gets_its_port_reset(connect, device):
    bridge = SimulatedBridge(device, faults={0: "phase error"}, refuses_reset=True)
    transport = connect(bridge)
    with pytest.raises(TransportError, match="phase"):
        transport.execute(*device.reading(200))
    assert transport.execute(*device.reading(200)).data == device.memory[:200]
    assert "port reset" in bridge.log
    assert bridge.device.multi_target  # and SCSI IDs were enabled again


def test_ctrl_c_in_a_transfer_leaves_a_bridge_that_can_be_parked(connect, device, monkeypatch):
    bridge = SimulatedBridge(device)
    transport = connect(bridge)

    def interrupted(*_arguments):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(bridge, "bulk_read", interrupted)
        with pytest.raises(KeyboardInterrupt):
            transport.execute(*device.reading(200))
    assert transport.execute(bytes([device.WRITE] + 5 * [0]), b"laser off") == Reply(GOOD)
    assert device.written == [b"laser off"]


def test_a_bridge_is_left_in_order_for_the_next_program(connect, device):
    bridge = SimulatedBridge(device, faults={0: "long data"})
    first = connect(bridge)
    with pytest.raises(TransportError):
        first.execute(*device.reading(200))
    first.close()
    assert connect(bridge).execute(*device.reading(200)).data == device.memory[:200]


def test_unplugged_and_plugged_in_again(connect, device):
    bridge = SimulatedBridge(device, faults={1: "disconnect"})
    transport = connect(bridge)
    transport.execute(*device.reading(8))
    for _ in range(2):
        with pytest.raises(TransportError) as caught:
            transport.execute(*device.reading(8))
        assert "plug" in caught.value.hint
    transport.close()
    with pytest.raises(TransportError, match="07af:0005"):
        find_device(*MICROTECH, backend=bridge)
    bridge.plug()
    assert connect(bridge).execute(*device.reading(8)).data == device.memory[:8]


def test_the_kernels_driver_gives_way_and_gets_its_interface_back(connect, device):
    bridge = SimulatedBridge(device, kernel_driver=True)
    transport = connect(bridge)
    transport.execute(bytes(6))
    transport.close()
    transport.close()
    assert bridge.kernel_driver
    assert bridge.log == [
        "open", "detach kernel driver", "claim", "mass storage reset", "release", "attach kernel driver", "close",
    ]  # fmt: skip


def test_a_bridge_that_another_program_holds_is_given_back_as_it_was(connect, device, monkeypatch):
    bridge = SimulatedBridge(device, kernel_driver=True)

    def busy(*_arguments):
        raise usb.core.USBError("Resource busy", None, errno.EBUSY)

    monkeypatch.setattr(bridge, "claim_interface", busy)
    with pytest.raises(TransportError) as caught:
        connect(bridge)
    assert "another program" in caught.value.hint
    assert bridge.kernel_driver
    assert bridge.log[-1] == "close"


@pytest.mark.parametrize(("target", "byte"), [(0, 0x00), (5, 0x50), (7, 0x70)])
def test_the_microtech_takes_the_scsi_id_in_the_upper_nibble(connect, device, target, byte):
    bridge = SimulatedBridge(device, scsi_id=target)
    connect(bridge, target=target).execute(bytes(6))
    assert [wrapper.lun for wrapper in bridge.device.wrappers] == [byte]
    assert bridge.device.multi_target


def test_other_bridges_take_it_as_they_want_it(connect, device):
    bridge = SimulatedBridge(device, numbers=USB2XCHANGE)
    connect(bridge).execute(bytes(6))
    assert bridge.device.wrappers[0].lun == 5
    plain = SimulatedBridge(device, numbers=UNKNOWN)
    connect(plain).execute(bytes(6))
    assert plain.device.wrappers[0].lun == 0


def test_an_empty_scsi_id_is_reported_and_disturbs_nothing(connect, device):
    bridge = SimulatedBridge(device, numbers=USB2XCHANGE)
    transport = connect(bridge, target=3)
    for _ in range(2):
        with pytest.raises(NoSuchTarget):
            transport.execute(*device.reading(36))
    assert bridge.log == ["open", "claim", "mass storage reset"]  # the one at the start


def test_an_empty_microtech_bridge_gives_no_data(connect, device):
    reply = connect(SimulatedBridge(device), target=3).execute(*device.reading(36))
    assert reply == Reply(CHECK_CONDITION)


@pytest.mark.parametrize("target", (-1, 8, 15))
def test_a_scsi_id_that_no_bus_has_is_refused(connect, device, target):
    """The USB2Xchange hangs when it is asked for one."""
    with pytest.raises(SettingsError, match="SCSI ID"):
        connect(SimulatedBridge(device), target=target)


def test_a_bridge_without_firmware_says_so(connect, device):
    with pytest.raises(TransportError, match="firmware"):
        connect(SimulatedBridge(device, numbers=USB2XCHANGE_ASLEEP))


def test_a_device_without_bulk_pipes_is_not_a_bridge(connect, device, monkeypatch):
    bridge = SimulatedBridge(device, numbers=UNKNOWN)
    descriptor = bridge.get_endpoint_descriptor

    def interrupt(*arguments):
        endpoint = descriptor(*arguments)
        endpoint.bmAttributes = 0x03
        return endpoint

    monkeypatch.setattr(bridge, "get_endpoint_descriptor", interrupt)
    with pytest.raises(TransportError, match="bulk"):
        connect(bridge)


def test_the_time_is_for_the_whole_command(connect, device, monkeypatch):
    """Each part of a command gets what the parts before it left over."""
    ticks = itertools.count(step=0.25)
    bridge = SimulatedBridge(device)
    limits = []
    for name in ("bulk_write", "bulk_read"):
        original = getattr(bridge, name)

        def limited(*arguments, original=original):
            limits.append(arguments[-1])
            return original(*arguments)

        monkeypatch.setattr(bridge, name, limited)
    transport = connect(bridge, clock=lambda: next(ticks))
    transport.execute(*device.reading(36), timeout=0.6)
    assert limits == [350, 100, 1]


def test_missing_libusb_is_reported(monkeypatch):
    monkeypatch.setattr(usb_transport.libusb_package, "get_libusb1_backend", lambda: None)
    with pytest.raises(TransportError, match="libusb"):
        usb_transport.load_backend()


def test_the_real_libusb_can_be_loaded():
    """In a process of its own: libusb keeps a thread for as long as it is loaded."""
    load = "from drivers.scsi.usb import load_backend; load_backend()"
    subprocess.run([sys.executable, "-c", load], check=True)
