"""What every transport refuses to carry, and sense data that it asks for itself."""

from __future__ import annotations

import pytest

from drivers.scanner import SettingsError
from drivers.scsi.checks import MAX_CDB_LENGTH, check_command, with_sense
from drivers.scsi.commands import REQUEST_SENSE
from drivers.scsi.in_process import InProcess
from drivers.scsi.sense import Key, Sense, parse_sense
from drivers.scsi.transport import CHECK_CONDITION, GOOD, Reply

CDB = bytes(6)
SENSE = Sense(Key.NOT_READY, 0x04, 0x01)


@pytest.mark.parametrize(
    ("cdb", "data_out", "data_in_length", "timeout", "fault"),
    [
        (b"", b"", 0, 1.0, "not 0"),
        (bytes(MAX_CDB_LENGTH + 1), b"", 0, 1.0, "not 17"),
        (CDB, b"1", 1, 1.0, "one way"),
        (CDB, b"", -1, 1.0, "not -1"),
        (CDB, b"", 1 << 40, 1.0, f"not {1 << 40}"),
        (CDB, b"", 0, 0.0, "some time"),
        (CDB, b"", 0, float("nan"), "some time"),
    ],
)
def test_a_command_that_no_bus_carries_is_refused(device, cdb, data_out, data_in_length, timeout, fault):
    with pytest.raises(SettingsError, match=fault):
        check_command(InProcess(device), cdb, data_out, data_in_length, timeout)


def test_the_longest_command_and_the_largest_block_are_carried(device):
    transport = InProcess(device)
    check_command(transport, bytes(MAX_CDB_LENGTH), b"", transport.max_transfer, 1.0)
    check_command(transport, CDB, bytes(transport.max_transfer), 0, 1.0)


def test_sense_data_are_asked_for_once_and_only_where_they_are_missing(device):
    transport = InProcess(device)
    device.execute(bytes([device.FAIL, 0, SENSE.key, SENSE.code, SENSE.qualifier, 0]), b"", 0)
    asked = len(device.commands)
    reply = with_sense(transport, CDB, Reply(CHECK_CONDITION), 1.0)
    assert parse_sense(reply.sense) == SENSE
    assert len(device.commands) == asked + 1
    for kept in (reply, Reply(GOOD)):
        assert with_sense(transport, CDB, kept, 1.0) is kept
    refused = Reply(CHECK_CONDITION)
    assert with_sense(transport, bytes([REQUEST_SENSE, 0, 0, 0, 0, 0]), refused, 1.0) is refused
    assert len(device.commands) == asked + 1
