"""A small SCSI device for the tests of the ways to it: it remembers, it fails, and it says why."""

from __future__ import annotations

import pytest

from drivers.scsi.commands import INQUIRY, REQUEST_SENSE, Identity
from drivers.scsi.sense import Key, Sense
from drivers.scsi.transport import BUSY, CHECK_CONDITION, GOOD, Reply


class Device:
    """Answers INQUIRY and REQUEST SENSE, and commands to read, write, fail and be busy.

    READ gives `memory`; FAIL takes its sense key, code and qualifier from the CDB.
    """

    IDENTITY = Identity(6, "MINOLTA", "VIVID 900", "1.00")
    WRITE, READ, FAIL, BE_BUSY, FAIL_WITH_DATA = range(0xC1, 0xC6)

    def __init__(self) -> None:
        self.memory = bytes(range(256)) * 128  # 32 KiB
        self.written: list[bytes] = []
        self.commands: list[bytes] = []
        self._sense = Sense(Key.NO_SENSE)

    def execute(self, cdb: bytes, data_out: bytes, data_in_length: int) -> Reply:
        self.commands.append(cdb)
        sense, self._sense = self._sense, Sense(Key.NO_SENSE)
        opcode = cdb[0]
        if opcode == INQUIRY:
            return Reply(GOOD, self.IDENTITY.build()[:data_in_length])
        if opcode == REQUEST_SENSE:
            return Reply(GOOD, sense.build()[:data_in_length])
        if opcode == self.READ:
            return Reply(GOOD, self.memory[:data_in_length])
        if opcode in (self.FAIL, self.FAIL_WITH_DATA):
            self._sense = Sense(Key(cdb[2]), cdb[3], cdb[4])
            return Reply(CHECK_CONDITION, b"\x01\x02\x03"[:data_in_length] if opcode == self.FAIL_WITH_DATA else b"")
        if opcode == self.WRITE:
            self.written.append(data_out)
        return Reply(BUSY if opcode == self.BE_BUSY else GOOD)

    def reading(self, length: int) -> tuple[bytes, bytes, int]:
        """The arguments of `execute` to read so many bytes."""
        return bytes([self.READ, 0, 0, 0, 0, 0]), b"", length


@pytest.fixture
def device() -> Device:
    return Device()
