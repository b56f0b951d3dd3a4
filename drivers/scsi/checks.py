"""Checks that every transport applies to a command, and the automatic REQUEST SENSE."""

from __future__ import annotations

from drivers.scanner import SettingsError
from drivers.scsi.commands import REQUEST_SENSE, request_sense
from drivers.scsi.sense import SENSE_LENGTH
from drivers.scsi.transport import CHECK_CONDITION, Reply, Transport

MAX_CDB_LENGTH = 16  # bytes; the command block of a Bulk-Only wrapper and of SG_IO's ordinary commands ends there
SAFE_TRANSFER = 32 * 1024
"""Bytes per command that every known bridge supports; the USB2Xchange has the least."""


def check_command(transport: Transport, cdb: bytes, data_out: bytes, data_in_length: int, timeout: float) -> None:
    """Raise SettingsError for a command that the transport cannot carry."""
    most = transport.max_transfer
    faults = {
        f"a command block has 1 to {MAX_CDB_LENGTH} bytes, not {len(cdb)}": not 1 <= len(cdb) <= MAX_CDB_LENGTH,
        "a command carries data one way, not both": bool(data_out) and data_in_length != 0,
        f"a command carries 0 to {most} bytes here, not {data_in_length}": not 0 <= data_in_length <= most,
        f"a command carries 0 to {most} bytes here, not {len(data_out)}": len(data_out) > most,
        f"a command needs some time, not {timeout} s": not timeout > 0,
    }
    for fault, found in faults.items():
        if found:
            raise SettingsError(fault, "this is a fault of the program: please report it")


def with_sense(transport: Transport, cdb: bytes, reply: Reply, timeout: float) -> Reply:
    """Return the reply with sense data, requested if the bus sent none.

    Raises TransportError.
    """
    if reply.status != CHECK_CONDITION or reply.sense or cdb[0] == REQUEST_SENSE:
        return reply
    sense = transport.execute(request_sense(SENSE_LENGTH), data_in_length=SENSE_LENGTH, timeout=timeout).data
    return Reply(reply.status, reply.data, sense)
