"""Sends commands: waits while busy, raises sense data, reads in chunks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import inf
from time import monotonic
from time import sleep as real_sleep
from typing import Literal

from drivers.scanner import DeviceError, SettingsError
from drivers.scsi import commands as scsi
from drivers.scsi.commands import Identity
from drivers.scsi.errors import SCAN_AGAIN, BadReply
from drivers.scsi.sense import Key, parse_sense
from drivers.scsi.transport import BUSY, CHECK_CONDITION, GOOD, RESERVATION_CONFLICT, TASK_SET_FULL, Reply, Transport
from drivers.vivid900.errors import BarrierClosed, DeadlineExceeded, Interrupted, NotReady, StillBusy
from drivers.vivid900.faults import error_of
from drivers.vivid900.profile.commands import Command
from drivers.vivid900.profile.profile import Profile

COMMAND_S = 10.0  # the longest block takes the scanner a second and a half to send (manual p. 59)
BUSY_S = 15.0  # the longest operation: a FINE shot with the motor's turn before it and the colours after it takes 5 s
FIRST_PAUSE_S, MAX_PAUSE_S, PAUSE_GROWTH = 0.02, 0.5, 1.5
ASKING = frozenset({"status", "read_parameters"})  # all that a profile may send before it is trusted
MAX_ATTENTIONS = 8  # power-on, reset, lens change and the like are reported one by one before anything else


def pauses() -> Iterator[float]:
    """Seconds to wait between polls: short at first, growing to half a second."""
    pause = FIRST_PAUSE_S
    while True:
        yield pause
        pause = min(pause * PAUSE_GROWTH, MAX_PAUSE_S)


@dataclass(frozen=True)
class Link:
    """A scanner at the end of a transport.

    profile    None until the scanner is identified: then only the standard's commands can be sent.
    command_s  time-out of one command, seconds.
    deadline   time of the clock after which no command is sent; limit_s: seconds that were given, for the message.
    """

    transport: Transport
    profile: Profile | None = None
    clock: Callable[[], float] = monotonic
    sleep: Callable[[float], None] = real_sleep
    command_s: float = COMMAND_S
    deadline: float = inf
    limit_s: float = inf

    def within(self, seconds: float, *, command_s: float = COMMAND_S) -> Link:
        """Return the same link with a deadline `seconds` from now."""
        return replace(self, deadline=self.clock() + seconds, limit_s=seconds, command_s=command_s)

    def identify(self) -> Identity:
        """INQUIRY. Raises TransportError, BadReply, or DeviceError when no unit is there."""
        identity = scsi.parse_identity(self.run(Command("inquiry", scsi.inquiry(), b"", scsi.INQUIRY_LENGTH)))
        if not identity.connected:
            raise DeviceError(f"the bus has a place for {identity}, but it is not there", "switch it on")
        return identity

    def clear_attentions(self) -> None:
        """Clear pending unit attentions: a device reports each in place of an answer."""
        for _ in range(MAX_ATTENTIONS):
            try:
                self.run(Command("test_unit_ready", scsi.test_unit_ready()))
            except Interrupted:
                continue
            except DeviceError:  # not ready, and it says so: it is listening
                pass
            return
        raise Interrupted("the scanner is reset again and again", SCAN_AGAIN)

    def readiness(self) -> Literal["ready", "busy", "warming-up", "barrier-closed"]:
        """Return the state of a scanner without a status command.

        It comes from TEST UNIT READY. Raises the error of other sense data.
        """
        command = Command("test_unit_ready", scsi.test_unit_ready())
        reply = self.transport.execute(command.cdb, b"", 0, self._timeout())
        if reply.status in (BUSY, TASK_SET_FULL):
            return "busy"
        try:
            self._data(command, reply)
        except BarrierClosed:
            return "barrier-closed"
        except NotReady:
            return "warming-up"
        return "ready"

    def run(self, command: Command) -> bytes:
        """Send a command, repeated while the scanner is busy.

        Returns the bytes asked for.
        Raises the error of the sense data, BadReply for an invalid answer, StillBusy, TransportError, SettingsError for
        a command outside the standard when a profile is missing, and NotTrusted for one that does not only read when
        the profile is not trusted.
        """
        if command.cdb[0] not in scsi.STANDARD:
            if self.profile is None:
                raise SettingsError("without a profile only the commands of the standard are sent", "name a profile")
            if command.name not in ASKING or command.data_out:
                self.profile.require_trust(command.name)
        busy_end = self.clock() + BUSY_S
        for pause in pauses():
            reply = self.transport.execute(command.cdb, command.data_out, command.data_in_length, self._timeout())
            if reply.status not in (BUSY, TASK_SET_FULL):
                return self._data(command, reply)
            if self.clock() >= busy_end:
                break
            self.sleep(min(pause, self._timeout()))
        raise StillBusy(
            f"the scanner has been busy for {BUSY_S:g} s", "look at its panel; switch it off and on if it stays so"
        )

    def read(self, part: Callable[[int, int], Command], total: int) -> bytes:
        """Read `total` bytes with the commands part(offset, length).

        Each is as large as profile and transport allow. A command without a length field reads all of them at once, one
        without an offset the bytes after those before.
        """
        chunk = min(self.transport.max_transfer, self.profile.chunk_bytes if self.profile else total)
        if "length" not in part(0, chunk).values:
            chunk = total
        data = bytearray()
        while len(data) < total:
            data += self.run(part(len(data), min(chunk, total - len(data))))
        return bytes(data)

    def _timeout(self) -> float:
        """Seconds that the next command may take. Raises DeadlineExceeded."""
        left = self.deadline - self.clock()
        if left <= 0:
            raise DeadlineExceeded(
                f"the scanner took longer than the {self.limit_s:g} s that it may",
                "check the cable and the bus; a slow capture may be given more time with `deadline_s` in [capture]",
            )
        return min(self.command_s, left)

    def _data(self, command: Command, reply: Reply) -> bytes:
        if reply.status == CHECK_CONDITION:
            sense = parse_sense(reply.sense)
            if sense.key is not Key.RECOVERED_ERROR:
                raise error_of(sense, self.profile.panel_by_sense if self.profile else None)
        elif reply.status == RESERVATION_CONFLICT:
            raise DeviceError("another computer holds the scanner", "close the program that uses it there")
        elif reply.status != GOOD:
            raise BadReply(f"status {reply.status:02X}h is not a status of {command.name}")
        if len(reply.data) != command.data_in_length:
            raise BadReply(f"{command.name}: {len(reply.data)} bytes came of {command.data_in_length}")
        return reply.data
