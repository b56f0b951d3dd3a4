"""Contract tests of the transports, run over each of them."""

from __future__ import annotations

import io
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Thread

import pytest

from drivers.scanner import SettingsError, TransportError
from drivers.scsi.commands import inquiry, parse_identity
from drivers.scsi.in_process import InProcess
from drivers.scsi.replay import Recorder, Replay
from drivers.scsi.sense import Key, Sense
from drivers.scsi.tcp import TcpDevice
from drivers.scsi.transport import BUSY, CHECK_CONDITION, GOOD, Reply, Target, Transport
from drivers.scsi.usb import UsbBulkOnly, find_device
from drivers.simulated.serve import listen, serve
from oracles.simulation.buses.sg_node import SimulatedSgNode
from oracles.simulation.buses.usb_bridge import MICROTECH, SimulatedBridge

Check = Callable[[Transport], None]

# Around the length of a status wrapper and of a packet, and the most of a safe transfer.
LENGTHS = (1, 12, 13, 14, 63, 64, 65, 127, 128, 512, 4096, 32 * 1024)


@contextmanager
def over_sg(device: Target) -> Iterator[Transport]:
    transport = SimulatedSgNode(device).connect()
    try:
        yield transport
    finally:
        transport.close()


@contextmanager
def over_usb(device: Target, numbers: tuple[int, int] = MICROTECH) -> Iterator[Transport]:
    bridge = SimulatedBridge(device, numbers=numbers, scsi_id=5)
    transport = UsbBulkOnly(find_device(*numbers, backend=bridge), target=5)
    try:
        yield transport
    finally:
        transport.close()


@contextmanager
def over_tcp(device: Target) -> Iterator[Transport]:
    with listen() as listener:
        server = Thread(target=serve, args=(device, listener))
        server.start()
        transport = TcpDevice(*listener.getsockname())
        try:
            yield transport
        finally:
            transport.close()
            listener.shutdown(socket.SHUT_RDWR)
            server.join()


class TransportContract:
    """Subclassed for each transport. `carry_out` runs a check over it."""

    def carry_out(self, device: Target, check: Check) -> None:
        raise NotImplementedError

    @pytest.mark.parametrize("length", LENGTHS)
    def test_data_comes_whole(self, device, length):
        def check(transport: Transport) -> None:
            assert transport.execute(*device.reading(length)) == Reply(GOOD, device.memory[:length])

        self.carry_out(device, check)

    @pytest.mark.parametrize("sent", (0, *LENGTHS[:-1]))
    def test_a_device_that_sends_less_gives_less(self, device, sent):
        device.memory = device.memory[:sent]

        def check(transport: Transport) -> None:
            assert transport.execute(*device.reading(32 * 1024)) == Reply(GOOD, device.memory)

        self.carry_out(device, check)

    @pytest.mark.parametrize("length", LENGTHS)
    def test_data_goes_whole(self, device, length):
        content = device.memory[:length]

        def check(transport: Transport) -> None:
            assert transport.execute(bytes([device.WRITE] + 9 * [0]), content) == Reply(GOOD)

        self.carry_out(device, check)
        assert device.written == [content]

    @pytest.mark.parametrize("cdb_length", (6, 10, 12, 16))
    def test_the_command_block_arrives_byte_for_byte(self, device, cdb_length):
        cdb = bytes(range(cdb_length))

        def check(transport: Transport) -> None:
            assert transport.execute(cdb) == Reply(GOOD)

        self.carry_out(device, check)
        assert device.commands == [cdb]

    def test_sense_data_comes_with_check_condition_and_only_then(self, device):
        def check(transport: Transport) -> None:
            failed = transport.execute(bytes([device.FAIL, 0, Key.NOT_READY, 0x04, 0x01, 0]))
            assert failed == Reply(CHECK_CONDITION, b"", Sense(Key.NOT_READY, 0x04, 0x01).build())
            assert transport.execute(*device.reading(8)).sense == b""

        self.carry_out(device, check)

    def test_data_before_a_check_condition_is_kept(self, device):
        def check(transport: Transport) -> None:
            failed = transport.execute(bytes([device.FAIL_WITH_DATA, 0, Key.MEDIUM_ERROR, 0x11, 0, 0]), b"", 200)
            assert failed == Reply(CHECK_CONDITION, b"\x01\x02\x03", Sense(Key.MEDIUM_ERROR, 0x11).build())

        self.carry_out(device, check)

    def test_busy_is_reported_as_busy(self, device):
        def check(transport: Transport) -> None:
            assert transport.execute(bytes([device.BE_BUSY, 0, 0, 0, 0, 0])) == Reply(BUSY)
            assert transport.execute(bytes([device.BE_BUSY, 0, 0, 0, 0, 0]), b"", 36) == Reply(BUSY)

        self.carry_out(device, check)

    def test_a_device_says_what_it_is(self, device):
        def check(transport: Transport) -> None:
            assert parse_identity(transport.execute(inquiry(), data_in_length=36).data) == device.IDENTITY

        self.carry_out(device, check)

    def test_many_commands_in_a_row(self, device):
        def check(transport: Transport) -> None:
            for length in range(1, 300):
                assert transport.execute(*device.reading(length)).data == device.memory[:length]

        self.carry_out(device, check)

    @pytest.mark.parametrize(
        "command",
        [
            (b"",),
            (bytes(17),),
            (bytes(6), b"both", 4),
            (bytes(6), b"", -1),
            (bytes(6), b"", 1 << 30),
            (bytes(6), bytes((1 << 20) + 1)),
            (bytes(6), b"", 0, 0.0),
            (bytes(6), b"", 0, float("nan")),
        ],
    )
    def test_what_no_bus_could_carry_is_refused_before_it_is_sent(self, device, command):
        def check(transport: Transport) -> None:
            with pytest.raises(SettingsError):
                transport.execute(*command)

        self.carry_out(device, check)
        assert device.commands == []

    def test_a_closed_transport_is_closed(self, device):
        def check(transport: Transport) -> None:
            transport.close()
            transport.close()
            with pytest.raises(TransportError, match="closed"):
                transport.execute(bytes(6))

        self.carry_out(device, check)
        assert device.commands == []


class TestSg(TransportContract):
    def carry_out(self, device, check):
        with over_sg(device) as transport:
            check(transport)


class TestUsbWithTheIdInTheUpperNibble(TransportContract):
    def carry_out(self, device, check):
        with over_usb(device) as transport:
            check(transport)


class TestUsbWithTheIdAlone(TransportContract):
    def carry_out(self, device, check):
        with over_usb(device, (0x03F3, 0x2003)) as transport:
            check(transport)


class TestInProcess(TransportContract):
    def carry_out(self, device, check):
        check(InProcess(device))


class TestTcp(TransportContract):
    def carry_out(self, device, check):
        with over_tcp(device) as transport:
            check(transport)


class TestReplay(TransportContract):
    """The check runs twice: recorded over a bridge, then against the recording, and must not notice."""

    def carry_out(self, device, check):
        file = io.StringIO()
        with over_usb(device) as recorded:
            check(Recorder(recorded, file))
        seen = list(device.commands)
        check(Replay(file.getvalue().splitlines()))
        assert device.commands == seen  # the device is not asked again
