"""SG_IO: the kernel's structure byte for byte, and everything that the kernel may report."""

from __future__ import annotations

import ctypes
import errno
import os
import struct
from pathlib import Path

import pytest

from drivers.scanner import TransportError
from drivers.scsi.sense import Key, Sense
from drivers.scsi.sg import SgDevice, SgIoHeader
from drivers.scsi.transport import CHECK_CONDITION, GOOD, Reply
from oracles.simulation.buses.sg_node import Fault, SimulatedSgNode

# include/scsi/sg.h, written down again: the fields of sg_io_hdr_t in their order and C types.
INPUT = struct.Struct("@ iiBBHI PPP IIiP")
OUTPUT = struct.Struct("@ BBBB HH iII")
PADDING = -(INPUT.size + OUTPUT.size) % struct.calcsize("P")  # a structure's size is a multiple of its pointers'


@pytest.fixture
def node(tmp_path) -> Path:
    """A file in place of a node: it can be opened everywhere; the ioctl is ours."""
    path = tmp_path / "sg0"
    path.touch()
    return path


@pytest.fixture
def connect(node):
    """Open a device with an injected ioctl; closed at the end of the test."""
    opened = []

    def connect(ioctl) -> SgDevice:
        opened.append(SgDevice(node, ioctl=ioctl))
        return opened[-1]

    yield connect
    for device in opened:
        device.close()


class Kernel:
    """Keeps the bytes of the structure as they arrive, and answers with prepared ones."""

    def __init__(self, answer: bytes = bytes(OUTPUT.size), data: bytes = b"", sense: bytes = b"") -> None:
        self.answer, self.data, self.sense = answer, data, sense

    def __call__(self, node: int, request: int, header: SgIoHeader) -> int:
        self.node, self.request = node, request
        self.seen = bytes(header)
        self.cdb = ctypes.string_at(header.cmdp, header.cmd_len)
        self.sent = ctypes.string_at(header.dxferp, header.dxfer_len) if header.dxferp else b""
        if self.data:
            ctypes.memmove(header.dxferp, self.data, len(self.data))
        if self.sense:
            ctypes.memmove(header.sbp, self.sense, len(self.sense))
        ctypes.memmove(ctypes.addressof(header) + INPUT.size, self.answer, len(self.answer))
        return 0


def answer(status=0, *, sense=0, host=0, driver=0, resid=0) -> bytes:
    return OUTPUT.pack(status, (status >> 1) & 0x1F, 0, sense, host, driver, resid, 12, 0)


@pytest.mark.skipif(struct.calcsize("P") != 8, reason="the published size is that of 64-bit machines")
def test_the_structure_has_the_published_size_and_places():
    assert ctypes.sizeof(SgIoHeader) == 88
    places = {name: getattr(SgIoHeader, name).offset for name, _ in SgIoHeader._fields_}
    assert places == {
        "interface_id": 0, "dxfer_direction": 4, "cmd_len": 8, "mx_sb_len": 9, "iovec_count": 10, "dxfer_len": 12,
        "dxferp": 16, "cmdp": 24, "sbp": 32, "timeout": 40, "flags": 44, "pack_id": 48, "usr_ptr": 56, "status": 64,
        "masked_status": 65, "msg_status": 66, "sb_len_wr": 67, "host_status": 68, "driver_status": 70, "resid": 72,
        "duration": 76, "info": 80,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("data_out", "asked", "direction"),
    [(b"", 0, -1), (b"\xaa\xbb\xcc", 0, -2), (b"", 300, -3)],
)
def test_every_byte_that_the_kernel_is_given(connect, data_out, asked, direction):
    kernel = Kernel()
    cdb = bytes.fromhex("c1 02 03 04 05 06 07 08 09 0a")
    connect(kernel).execute(cdb, data_out, asked, timeout=2.5)
    length = asked or len(data_out)
    *_, data_at, command_at, sense_at, _timeout, _flags, _pack_id, _user = INPUT.unpack(kernel.seen[: INPUT.size])
    wanted = INPUT.pack(ord("S"), direction, 10, 64, 0, length, data_at, command_at, sense_at, 2500, 0, 0, 0)
    assert kernel.seen == wanted + bytes(OUTPUT.size + PADDING)
    assert kernel.request == 0x2285
    assert kernel.cdb == cdb
    assert kernel.sent == (data_out or bytes(asked))
    assert (data_at != 0) == (length > 0)
    assert 0 not in (command_at, sense_at)


def test_the_residue_shortens_the_data(connect):
    kernel = Kernel(answer(resid=6), data=b"0123456789")
    assert connect(kernel).execute(bytes(6), data_in_length=10) == Reply(GOOD, b"0123")


def test_sense_data_is_as_long_as_the_kernel_wrote(connect):
    sense = Sense(Key.UNIT_ATTENTION, 0x29).build()
    kernel = Kernel(answer(CHECK_CONDITION, sense=len(sense), driver=0x08), sense=sense + b"old")
    assert connect(kernel).execute(bytes(6)) == Reply(CHECK_CONDITION, b"", sense)


def test_sense_data_that_the_kernel_did_not_bring_is_asked_for(connect, device):
    def no_autosense(header: SgIoHeader) -> None:
        header.sb_len_wr = 0

    node = SimulatedSgNode(device, faults={0: Fault(no_autosense)})
    reply = connect(node.ioctl).execute(bytes([device.FAIL, 0, Key.HARDWARE_ERROR, 0x44, 0, 0]))
    assert reply.status == CHECK_CONDITION
    assert len(reply.sense) == 18
    assert node.commands == 2


@pytest.mark.parametrize("status", (0x02 | 0x01, 0x08 | 0x80, 0x18 | 0x40))
def test_reserved_bits_of_the_status_are_left_out(connect, status):
    assert connect(Kernel(answer(status, sense=18))).execute(bytes(6)).status == status & 0x3E


@pytest.mark.parametrize("host", range(1, 0x20))
def test_every_fault_of_the_card_is_a_fault_of_the_way(connect, host):
    with pytest.raises(TransportError) as caught:
        connect(Kernel(answer(host=host))).execute(bytes(6))
    assert str(caught.value)
    assert caught.value.hint


@pytest.mark.parametrize("driver", (0x01, 0x03, 0x06, 0x16))
def test_every_fault_of_the_kernels_driver_too(connect, driver):
    with pytest.raises(TransportError, match="driver"):
        connect(Kernel(answer(driver=driver))).execute(bytes(6))


@pytest.mark.parametrize("resid", (-1, 11, 1 << 30))
def test_a_residue_that_cannot_be_is_a_fault(connect, resid):
    with pytest.raises(TransportError, match="missing"):
        connect(Kernel(answer(resid=resid))).execute(bytes(6), data_in_length=10)


def test_a_block_that_was_taken_in_part_is_a_fault(connect):
    with pytest.raises(TransportError, match="7 of 10"):
        connect(Kernel(answer(resid=3))).execute(bytes(6), bytes(10))


@pytest.mark.parametrize(
    ("number", "hint"),
    [
        (errno.EACCES, "udev"),
        (errno.EPERM, "udev"),
        (errno.ENOENT, "planish devices"),
        (errno.ENODEV, "gone"),
        (errno.ENXIO, "gone"),
        (errno.EIO, "cable"),
    ],
)
def test_a_node_that_cannot_be_opened_says_what_to_do(number, hint):
    def refuse(path: Path, flags: int) -> int:
        raise OSError(number, os.strerror(number))

    with pytest.raises(TransportError, match="/dev/sg3") as caught:
        SgDevice(Path("/dev/sg3"), open_node=refuse)
    assert hint in caught.value.hint


def test_an_ioctl_that_fails_is_a_fault_of_the_way(connect):
    def gone(*_arguments) -> int:
        raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))

    with pytest.raises(TransportError) as caught:
        connect(gone).execute(bytes(6))
    assert "gone" in caught.value.hint


def test_a_node_is_opened_for_one_program_alone():
    asked = []

    def busy(path: Path, flags: int) -> int:
        asked.append(flags)
        raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))

    with pytest.raises(TransportError, match="/dev/sg3 is in use") as caught:
        SgDevice(Path("/dev/sg3"), open_node=busy)
    assert asked[0] & os.O_EXCL
    assert asked[0] & os.O_NONBLOCK  # otherwise the kernel waits until the other program closes it
    assert caught.value.hint


def test_the_simulated_node_refuses_a_second_program_as_the_kernel_does(device):
    node = SimulatedSgNode(device)
    first = node.connect()
    with pytest.raises(TransportError, match="in use"):
        node.connect()
    first.close()
    node.connect().close()


def test_the_kernels_own_refusal_is_translated(node):
    """No injection: a node that is no SCSI device refuses the ioctl (ENOTTY)."""
    device = SgDevice(node)
    try:
        with pytest.raises(TransportError, match="sg0"):
            device.execute(bytes(6))
    finally:
        device.close()
