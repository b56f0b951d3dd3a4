"""The device's side of Bulk-Only: packets in, packets out, halts, and injected faults.

Source: USB Mass Storage Class, Bulk-Only Transport, revision 1.0, §5.3 and §6.7.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import Enum, auto

from drivers.scanner import TransportError
from drivers.scsi.bridges import BRIDGES, Addressing
from drivers.scsi.bulk_exchange import NO_SUCH_TARGET
from drivers.scsi.bulk_only import (
    FAILED,
    PASSED,
    PHASE_ERROR,
    STATUS_LENGTH,
    CommandWrapper,
    StatusWrapper,
    build_status,
    parse_command,
)
from drivers.scsi.transport import GOOD, Target
from oracles.simulation.buses.usb_descriptors import HIGH_SPEED


class Halted(Exception):
    """Raised when the pipe to the device is halted, or halts now."""


class Overflow(Exception):
    """Raised when a packet is longer than the room that the host left for it."""


class Ending(Enum):
    """How a transfer to the host ends. SILENCE: the device answers NAK until the host gives up."""

    DONE = auto()
    HALT = auto()
    SILENCE = auto()


@dataclass(frozen=True)
class Answer:
    """The device's transfers: data (None: the data phase is skipped), halts, status."""

    data: bytes | None
    status: bytes
    halt_after_data: bool = False
    halt_before_status: bool = False


def _status_bytes(edit: Callable[[bytearray], object]) -> Callable[[Answer], Answer]:
    def fault(answer: Answer) -> Answer:
        status = bytearray(answer.status)
        edit(status)
        return replace(answer, status=bytes(status))

    return fault


def _shorter(answer: Answer) -> Answer:
    return replace(answer, data=(answer.data or b"")[: len(answer.data or b"") // 2])


ANSWER_FAULTS: Mapping[str, Callable[[Answer], Answer]] = {
    "stall data": lambda answer: replace(answer, data=b"", halt_after_data=True),
    "stall status": lambda answer: replace(answer, halt_before_status=True),
    "short data": _shorter,
    "long data": lambda answer: replace(answer, data=(answer.data or b"") + bytes(HIGH_SPEED)),
    "status in place of data": lambda answer: replace(answer, data=None),
    "duplicate status": lambda answer: replace(answer, status=answer.status * 2),
    "wrong tag": _status_bytes(lambda status: status.__setitem__(4, status[4] ^ 0xFF)),
    "wrong signature": _status_bytes(lambda status: status.__setitem__(0, 0)),
    "short status": _status_bytes(lambda status: status.pop()),
    "senseless residue": _status_bytes(lambda status: status.__setitem__(slice(8, 12), b"\xff\xff\xff\x7f")),
    "senseless status": _status_bytes(lambda status: status.__setitem__(12, 0x55)),
    "phase error": _status_bytes(lambda status: status.__setitem__(12, PHASE_ERROR)),
    "no answer": lambda answer: replace(answer, data=None, status=b""),
}
FAULTS = ("refuse command", "disconnect", *ANSWER_FAULTS)
"""Names of the faults that can be injected into one command."""


class BulkOnlyDevice:
    """A bridge with one SCSI device.

    numbers   USB vendor and product number: they decide how the bridge takes SCSI IDs.
    scsi_id   where the device sits; packet_size: bytes of its longest packet.
    faults    names out of FAULTS by the index of the command.
    wrappers  every command wrapper that arrived.
    """

    def __init__(
        self,
        target: Target,
        *,
        numbers: tuple[int, int],
        scsi_id: int,
        packet_size: int,
        faults: Mapping[int, str],
    ) -> None:
        self._target, self._scsi_id, self._packet_size = target, scsi_id, packet_size
        self._bridge = BRIDGES.get(numbers)
        self.faults = dict(faults)
        self.wrappers: list[CommandWrapper] = []
        self.unplugged = False
        self.power_on()

    def power_on(self) -> None:
        """Forget everything: also what a reset of the port does."""
        self.multi_target = False
        self.halted_in = self.halted_out = False
        self.reset()

    def reset(self) -> None:
        """Bulk-Only Mass Storage Reset: ready for a command; halts stay until they are cleared (§3.1)."""
        self._packets: deque[bytes | None] = deque()  # None: the pipe halts here
        self._awaiting: CommandWrapper | None = None
        self.waits_for_reset = False

    def clear_halts(self, *, inward: bool) -> None:
        """Clear Feature HALT. After a refused command it has no effect before the reset (§5.3.1)."""
        if self.waits_for_reset:
            return
        if inward:
            self.halted_in = False
        else:
            self.halted_out = False

    def take(self, content: bytes) -> None:
        """A transfer from the host: a command, or the data of the command before. Raises Halted."""
        if self.halted_out or self.waits_for_reset:
            raise Halted
        if self._awaiting is None:
            self._take_command(content)
        else:
            wrapper, self._awaiting = self._awaiting, None
            self._answer(wrapper, content)

    def give(self, room: int) -> tuple[bytes, Ending]:
        """Packets to the host until one is short or the room is full, and why it ended before. Raises Overflow."""
        if self.halted_in:
            return b"", Ending.HALT
        came, packet = bytearray(), bytes(self._packet_size)
        while len(came) < room and len(packet) == self._packet_size:
            if not self._packets:
                return bytes(came), Ending.SILENCE
            if (upcoming := self._packets.popleft()) is None:
                self.halted_in = True
                return bytes(came), Ending.HALT
            packet = upcoming
            came += packet
        if len(came) > room:
            raise Overflow
        return bytes(came), Ending.DONE

    def _take_command(self, content: bytes) -> None:
        fault = self.faults.get(len(self.wrappers))
        try:
            wrapper = parse_command(content)
        except TransportError:
            fault, wrapper = "refuse command", None
        if wrapper is not None:
            self.wrappers.append(wrapper)
        if wrapper is None or fault == "refuse command":
            self.waits_for_reset = self.halted_in = self.halted_out = True
            raise Halted
        if fault == "disconnect":
            self.unplugged = True
        elif wrapper.length and not wrapper.from_device:
            self._awaiting = wrapper
        else:
            self._answer(wrapper, b"")

    def _answer(self, wrapper: CommandWrapper, data_out: bytes) -> None:
        status, data = self._ask(wrapper, data_out)
        if status is None:
            return
        if len(data) > wrapper.length and wrapper.from_device:  # more than the host has room for (§6.7.2, case 7)
            status, data = PHASE_ERROR, data[: wrapper.length]
        residue = wrapper.length - (len(data) if wrapper.from_device else len(data_out))
        answer = Answer(
            data if wrapper.from_device else None, build_status(StatusWrapper(wrapper.tag, residue, status))
        )
        fault = self.faults.get(len(self.wrappers) - 1, "")
        self._queue(ANSWER_FAULTS[fault](answer) if fault else answer, wrapper.length)
        if status == PHASE_ERROR or fault == "phase error":
            self.waits_for_reset = True

    def _ask(self, wrapper: CommandWrapper, data_out: bytes) -> tuple[int | None, bytes]:
        """Status and data; None for a device that does not answer: then the bridge does not either."""
        addressing = self._bridge.addressing if self._bridge else Addressing.NONE
        multi_target = self.multi_target or not (self._bridge and self._bridge.multi_target)
        if multi_target and wrapper.lun != addressing.lun_byte(self._scsi_id):
            return (NO_SUCH_TARGET if addressing is Addressing.WHOLE_BYTE else FAILED), b""
        try:
            reply = self._target.execute(wrapper.cdb, data_out, wrapper.length if wrapper.from_device else 0)
        except TransportError:  # the device is off, or its cable is out
            return None, b""
        return (PASSED if reply.status == GOOD else FAILED), reply.data

    def _queue(self, answer: Answer, asked: int) -> None:
        if answer.data is not None:
            self._packets.extend(_pieces(answer.data, self._packet_size))
            ended = len(answer.data) >= asked or len(answer.data) % self._packet_size
            if answer.halt_after_data or not ended:  # a full last packet does not end the transfer for the host
                self._packets.append(None)
        if answer.halt_before_status:
            self._packets.append(None)
        self._packets.extend(_pieces(answer.status, STATUS_LENGTH))


def _pieces(data: bytes, size: int) -> list[bytes]:
    return [data[start : start + size] for start in range(0, len(data), size)]
