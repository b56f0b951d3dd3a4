"""Fault injection between driver and device, by number of the command.

The faults are those of buses and devices.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from drivers.scanner import TransportError
from drivers.scsi.commands import REQUEST_SENSE
from drivers.scsi.sense import Key, Sense
from drivers.scsi.transport import BUSY, CHECK_CONDITION, GOOD, RESERVATION_CONFLICT, TASK_SET_FULL, Reply
from drivers.simulated.device.device import SimulatedDevice

UNKNOWN_STATUS = 0x7F
FLIPPED = 0x5A  # exclusive-ored into a damaged byte
DAMAGED_EVERY = 97  # bytes from one damaged byte to the next: every chunk and every block has some


@dataclass(frozen=True)
class Call:
    """A command in transfer."""

    cdb: bytes
    data_out: bytes
    data_in_length: int


Fault = Callable[["FaultyDevice", Call], Reply]


class FaultyDevice:
    """A device behind a connection that injects scripted faults.

    script  number of the command, 0 for the first since the script was set → fault. A command counts when a driver
            sends it; REQUEST SENSE after a fault counts as well.
    """

    def __init__(self, device: SimulatedDevice, script: Mapping[int, Fault] | None = None) -> None:
        self.device, self.script = device, dict(script or {})
        self.count, self.connected = 0, True
        self.sense: Sense | None = None
        self.last = Reply(GOOD)
        self.remembered: dict[bytes, Reply] = {}

    def set_script(self, script: Mapping[int, Fault]) -> None:
        """Restart the count with a new script; a disconnected device is connected again."""
        self.script, self.count, self.connected, self.sense = dict(script), 0, True, None

    def execute(self, cdb: bytes, data_out: bytes, data_in_length: int) -> Reply:
        """See Target. Raises TransportError where the script breaks the connection."""
        if not self.connected:
            raise TransportError("no device answers", "check the cable")
        fault, call = self.script.get(self.count, no_fault), Call(cdb, data_out, data_in_length)
        self.count += 1
        reply = fault(self, call)
        if fault is not stale:
            self.remembered[cdb] = reply
        self.last = reply
        return reply

    def no_fault(self, call: Call) -> Reply:
        """The device's own answer, or the sense data of a scripted fault."""
        if call.cdb[:1] == bytes([REQUEST_SENSE]) and self.sense is not None:
            scripted, self.sense = self.sense, None
            return Reply(GOOD, scripted.build()[: call.data_in_length])
        return self.device.execute(call.cdb, call.data_out, call.data_in_length)


def no_fault(faulty: FaultyDevice, call: Call) -> Reply:
    """No fault."""
    return faulty.no_fault(call)


def sense(key: Key, code: int = 0, qualifier: int = 0) -> Fault:
    """The device refuses the command with sense data."""

    def fault(faulty: FaultyDevice, _call: Call) -> Reply:
        faulty.sense = Sense(key, code, qualifier)
        return Reply(CHECK_CONDITION)

    return fault


def recovered(faulty: FaultyDevice, call: Call) -> Reply:
    """The device executes the command and reports a recovered error."""
    reply = faulty.no_fault(call)
    if reply.status != GOOD:
        return reply
    faulty.sense = Sense(Key.RECOVERED_ERROR, 0x17, 0x01)
    return Reply(CHECK_CONDITION, reply.data)


def status(value: int) -> Fault:
    """The device does not execute the command and returns only a status."""
    return lambda _faulty, _call: Reply(value)


def without_sense(_faulty: FaultyDevice, _call: Call) -> Reply:
    """CHECK CONDITION with invalid sense data."""
    return Reply(CHECK_CONDITION, b"", b"\x00\x12\x34")


def short(faulty: FaultyDevice, call: Call) -> Reply:
    """Half of the data is transferred."""
    reply = faulty.no_fault(call)
    return Reply(reply.status, reply.data[: len(reply.data) // 2], reply.sense)


def empty(faulty: FaultyDevice, call: Call) -> Reply:
    """None of the data is transferred."""
    return Reply(faulty.no_fault(call).status)


def long(faulty: FaultyDevice, call: Call) -> Reply:
    """More data is transferred than requested."""
    reply = faulty.no_fault(call)
    return Reply(reply.status, reply.data + bytes(range(64)), reply.sense)


def corrupt(faulty: FaultyDevice, call: Call) -> Reply:
    """Bytes are corrupted, in either direction; other bytes in every command."""
    place = faulty.count
    reply = faulty.no_fault(Call(call.cdb, _damaged(call.data_out, place), call.data_in_length))
    return Reply(reply.status, _damaged(reply.data, place), reply.sense)


def stale(faulty: FaultyDevice, call: Call) -> Reply:
    """The answer to the last identical command is repeated, maybe of an earlier shot."""
    reply = faulty.no_fault(call)
    return faulty.remembered.get(call.cdb, reply)


def duplicate(faulty: FaultyDevice, call: Call) -> Reply:
    """The answer to the previous command is repeated in place of this one's."""
    earlier = faulty.last
    faulty.no_fault(call)
    return earlier


def lost(_faulty: FaultyDevice, call: Call) -> Reply:
    """The device never receives the command, and the connection reports success."""
    return Reply(GOOD, bytes(call.data_in_length))


class NoAnswer(TransportError):
    """Raised when the host waits for an answer until its time-out."""


def timed_out(faulty: FaultyDevice, call: Call) -> Reply:
    """The device executes the command, but its answer is lost."""
    faulty.no_fault(call)
    raise NoAnswer("the scanner did not answer in time", "check the cable")


def never_sent(_faulty: FaultyDevice, _call: Call) -> Reply:
    """Lose the command, without an answer."""
    raise NoAnswer("the scanner did not answer in time", "check the cable")


def stalled(faulty: FaultyDevice, call: Call) -> Reply:
    """The pipe halts in the middle of the data, and the transfer is aborted."""
    faulty.no_fault(call)
    raise TransportError("the bridge refuses", "try again")


def phase_error(_faulty: FaultyDevice, _call: Call) -> Reply:
    """Phase error of the bridge, which was reset; the device is unaffected."""
    raise TransportError("the bridge lost its place (phase error)", "try again")


def disconnected(faulty: FaultyDevice, _call: Call) -> Reply:
    """The cable is disconnected until the next script."""
    faulty.connected = False
    raise TransportError("no device answers", "check the cable")


def reset(faulty: FaultyDevice, call: Call) -> Reply:
    """The bus is reset before the command."""
    faulty.device.reset()
    return faulty.no_fault(call)


def power_cycled(faulty: FaultyDevice, call: Call) -> Reply:
    """The scanner is switched off and on before the command."""
    faulty.device.power_off()
    faulty.device.power_on()
    return faulty.no_fault(call)


def _damaged(data: bytes, place: int) -> bytes:
    """Return the data with every DAMAGED_EVERYth byte damaged.

    At least one.
    place: decides which.
    """
    damaged = bytearray(data)
    for at in range(place % max(min(DAMAGED_EVERY, len(data)), 1), len(data), DAMAGED_EVERY):
        damaged[at] ^= FLIPPED
    return bytes(damaged)


FAULTS: dict[str, Fault] = {
    **{f"sense {key.name.lower().replace('_', ' ')}": sense(key) for key in Key},
    "sense recovered error": recovered,
    "becoming ready": sense(Key.NOT_READY, 0x04, 0x01),
    "barrier": sense(Key.NOT_READY, 0x80, 0x01),
    "parity": sense(Key.ABORTED_COMMAND, 0x47),
    "was reset": sense(Key.UNIT_ATTENTION, 0x29),
    "system error": sense(Key.HARDWARE_ERROR, 0x80, 0x07),
    "busy": status(BUSY),
    "queue full": status(TASK_SET_FULL),
    "reserved": status(RESERVATION_CONFLICT),
    "unknown status": status(UNKNOWN_STATUS),
    "sense without sense": without_sense,
    "short": short,
    "empty": empty,
    "long": long,
    "corrupt": corrupt,
    "stale": stale,
    "duplicate": duplicate,
    "lost": lost,
    "timed out": timed_out,
    "never_sent": never_sent,
    "stalled": stalled,
    "phase error": phase_error,
    "disconnected": disconnected,
    "reset": reset,
    "power cycled": power_cycled,
}
"""Every fault by its name."""
