"""Faults put between a driver and a device by the number of the command: what buses and devices do on bad days."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from drivers.scanner import TransportError
from drivers.simulated.device import SimulatedDevice
from drivers.vivid900.scsi import REQUEST_SENSE
from drivers.vivid900.sense import Key, Sense
from drivers.vivid900.transports import BUSY, CHECK_CONDITION, GOOD, RESERVATION_CONFLICT, TASK_SET_FULL, Reply

UNKNOWN_STATUS = 0x7F
FLIPPED = 0x5A  # exclusive-ored into a damaged byte
DAMAGED_EVERY = 97  # bytes from one damaged byte to the next: every chunk and every block has some


@dataclass(frozen=True)
class Call:
    """A command on its way."""

    cdb: bytes
    data_out: bytes
    data_in_length: int


Fault = Callable[["FaultyDevice", Call], Reply]


class FaultyDevice:
    """A device whose commands go wrong by a script.

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
        """Begin to count anew; what was unplugged is plugged in again."""
        self.script, self.count, self.connected, self.sense = dict(script), 0, True, None

    def execute(self, cdb: bytes, data_out: bytes, data_in_length: int) -> Reply:
        """See Target. Raises TransportError where the script breaks the way."""
        if not self.connected:
            raise TransportError("no device answers", "check the cable")
        fault, call = self.script.get(self.count, passed_on), Call(cdb, data_out, data_in_length)
        self.count += 1
        reply = fault(self, call)
        if fault is not stale:
            self.remembered[cdb] = reply
        self.last = reply
        return reply

    def passed_on(self, call: Call) -> Reply:
        """What the device itself answers, or the sense data of a scripted fault."""
        if call.cdb[:1] == bytes([REQUEST_SENSE]) and self.sense is not None:
            told, self.sense = self.sense, None
            return Reply(GOOD, told.build()[: call.data_in_length])
        return self.device.execute(call.cdb, call.data_out, call.data_in_length)


def passed_on(way: FaultyDevice, call: Call) -> Reply:
    """No fault."""
    return way.passed_on(call)


def sense(key: Key, code: int = 0, qualifier: int = 0) -> Fault:
    """The device does not do the command, and says why."""

    def fault(way: FaultyDevice, _call: Call) -> Reply:
        way.sense = Sense(key, code, qualifier)
        return Reply(CHECK_CONDITION)

    return fault


def recovered(way: FaultyDevice, call: Call) -> Reply:
    """The device does the command, and says that it had to try more than once."""
    reply = way.passed_on(call)
    if reply.status != GOOD:
        return reply
    way.sense = Sense(Key.RECOVERED_ERROR, 0x17, 0x01)
    return Reply(CHECK_CONDITION, reply.data)


def status(value: int) -> Fault:
    """The device does not do the command, and answers with a status alone."""
    return lambda _way, _call: Reply(value)


def without_sense(_way: FaultyDevice, _call: Call) -> Reply:
    """CHECK CONDITION whose sense data makes no sense."""
    return Reply(CHECK_CONDITION, b"", b"\x00\x12\x34")


def short(way: FaultyDevice, call: Call) -> Reply:
    """Half of the data comes."""
    reply = way.passed_on(call)
    return Reply(reply.status, reply.data[: len(reply.data) // 2], reply.sense)


def empty(way: FaultyDevice, call: Call) -> Reply:
    """None of the data comes."""
    return Reply(way.passed_on(call).status)


def long(way: FaultyDevice, call: Call) -> Reply:
    """More data comes than was asked for."""
    reply = way.passed_on(call)
    return Reply(reply.status, reply.data + bytes(range(64)), reply.sense)


def corrupt(way: FaultyDevice, call: Call) -> Reply:
    """Bytes are changed on their way, in either direction."""
    reply = way.passed_on(Call(call.cdb, _damaged(call.data_out), call.data_in_length))
    return Reply(reply.status, _damaged(reply.data), reply.sense)


def stale(way: FaultyDevice, call: Call) -> Reply:
    """The data of the last time that the same was asked comes, of an earlier shot maybe."""
    reply = way.passed_on(call)
    return way.remembered.get(call.cdb, reply)


def duplicate(way: FaultyDevice, call: Call) -> Reply:
    """The answer to the command before comes once more in place of this one's."""
    earlier = way.last
    way.passed_on(call)
    return earlier


def lost(_way: FaultyDevice, call: Call) -> Reply:
    """The device never sees the command, and the way says that all went well."""
    return Reply(GOOD, bytes(call.data_in_length))


def timed_out(way: FaultyDevice, call: Call) -> Reply:
    """The device does the command, but its answer never comes."""
    way.passed_on(call)
    raise TransportError("the scanner did not answer in time", "check the cable")


def unheard(_way: FaultyDevice, _call: Call) -> Reply:
    """The command never gets there, and no answer comes."""
    raise TransportError("the scanner did not answer in time", "check the cable")


def stalled(way: FaultyDevice, call: Call) -> Reply:
    """The pipe halts in the middle of the data, and the way gives up."""
    way.passed_on(call)
    raise TransportError("the bridge refuses", "try again")


def phase_error(_way: FaultyDevice, _call: Call) -> Reply:
    """The bridge lost its place and was reset; the device knows nothing of it."""
    raise TransportError("the bridge lost its place (phase error)", "try again")


def disconnected(way: FaultyDevice, _call: Call) -> Reply:
    """The cable is pulled, and stays so until the next script."""
    way.connected = False
    raise TransportError("no device answers", "check the cable")


def reset(way: FaultyDevice, call: Call) -> Reply:
    """The bus is reset before the command."""
    way.device.reset()
    return way.passed_on(call)


def power_cycled(way: FaultyDevice, call: Call) -> Reply:
    """The scanner is switched off and on before the command."""
    way.device.power_off()
    way.device.power_on()
    return way.passed_on(call)


def _damaged(data: bytes) -> bytes:
    damaged = bytearray(data)
    for at in range(min(DAMAGED_EVERY, len(data)) // 2, len(data), DAMAGED_EVERY):
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
    "unheard": unheard,
    "stalled": stalled,
    "phase error": phase_error,
    "disconnected": disconnected,
    "reset": reset,
    "power cycled": power_cycled,
}
"""Every fault by its name."""
