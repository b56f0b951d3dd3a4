"""Command and status wrappers of the Bulk-Only transport, without I/O.

Source: USB Mass Storage Class, Bulk-Only Transport, revision 1.0, §5 and §6.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from drivers.scanner import SettingsError, TransportError
from drivers.scsi.checks import MAX_CDB_LENGTH

COMMAND_SIGNATURE, STATUS_SIGNATURE = b"USBC", b"USBS"
COMMAND_LAYOUT, STATUS_LAYOUT = struct.Struct("<4sIIBBB16s"), struct.Struct("<4sIIB")
COMMAND_LENGTH, STATUS_LENGTH = COMMAND_LAYOUT.size, STATUS_LAYOUT.size  # 31 and 13 bytes
FROM_DEVICE_FLAG = 0x80

PASSED, FAILED, PHASE_ERROR = 0, 1, 2
"""bCSWStatus of a status wrapper (§5.2)."""

MASS_STORAGE, TRANSPARENT_SCSI, BULK_ONLY = 0x08, 0x06, 0x50
"""Interface class, subclass and protocol (§4.3)."""

RESET_REQUEST_TYPE, RESET_REQUEST = 0x21, 0xFF
"""Bulk-Only Mass Storage Reset: a class request to the interface (§3.1)."""


@dataclass(frozen=True)
class CommandWrapper:
    """The block that starts a command (CBW).

    tag          comes back in the status wrapper.
    length       bytes that the host expects to move.
    from_device  the direction of these bytes.
    lun          the addressed unit; some bridges encode the SCSI ID in it.
    cdb          the SCSI command, 1 to 16 bytes.
    """

    tag: int
    length: int
    from_device: bool
    lun: int
    cdb: bytes


@dataclass(frozen=True)
class StatusWrapper:
    """The status wrapper (CSW) that ends a command.

    residue: number of expected bytes that were not transferred.
    """

    tag: int
    residue: int
    status: int


def build_command(wrapper: CommandWrapper) -> bytes:
    """Return the 31 bytes of a command wrapper.

    Raises SettingsError unless the command has 1 to 16 bytes.
    """
    if not 1 <= len(wrapper.cdb) <= MAX_CDB_LENGTH:
        raise SettingsError(f"a command block has 1 to {MAX_CDB_LENGTH} bytes, not {len(wrapper.cdb)}")
    flags = FROM_DEVICE_FLAG if wrapper.from_device else 0
    return COMMAND_LAYOUT.pack(
        COMMAND_SIGNATURE, wrapper.tag, wrapper.length, flags, wrapper.lun, len(wrapper.cdb), wrapper.cdb
    )


def parse_command(data: bytes) -> CommandWrapper:
    """Read a command wrapper. Raises TransportError for any other bytes (§6.2.1)."""
    if len(data) != COMMAND_LENGTH or data[:4] != COMMAND_SIGNATURE:
        raise TransportError(f"these {len(data)} bytes are not a command wrapper")
    _, tag, length, flags, lun, cdb_length, cdb = COMMAND_LAYOUT.unpack(data)
    if not 1 <= cdb_length <= MAX_CDB_LENGTH:
        raise TransportError(f"a command block of {cdb_length} bytes")
    return CommandWrapper(tag, length, bool(flags & FROM_DEVICE_FLAG), lun, cdb[:cdb_length])


def build_status(wrapper: StatusWrapper) -> bytes:
    """The 13 bytes of a status wrapper."""
    return STATUS_LAYOUT.pack(STATUS_SIGNATURE, wrapper.tag, wrapper.residue, wrapper.status)


def parse_status(data: bytes) -> StatusWrapper:
    """Read a status wrapper. Raises TransportError for any other bytes (§6.3.1)."""
    if len(data) != STATUS_LENGTH or data[:4] != STATUS_SIGNATURE:
        raise TransportError(f"the bridge sent {len(data)} bytes that are not a status", "try again")
    _, tag, residue, status = STATUS_LAYOUT.unpack(data)
    return StatusWrapper(tag, residue, status)
