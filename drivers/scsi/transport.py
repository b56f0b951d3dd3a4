"""The transports to a SCSI device, all behind one interface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

GOOD, CHECK_CONDITION, BUSY, RESERVATION_CONFLICT, TASK_SET_FULL = 0x00, 0x02, 0x08, 0x18, 0x28
"""SCSI status bytes (SAM-2 §5.3.1)."""

DEFAULT_TIMEOUT_S = 10.0


@dataclass(frozen=True)
class Reply:
    """What a device answers to one command.

    status  SCSI status byte.
    data    bytes from the device, at most as many as requested.
    sense   sense data that came with CHECK CONDITION, empty otherwise.
    """

    status: int
    data: bytes = b""
    sense: bytes = b""


class Transport(Protocol):
    """A connection to one SCSI device.

    max_transfer  most bytes of one command; larger blocks are read in chunks.
    """

    max_transfer: int

    def execute(
        self, cdb: bytes, data_out: bytes = b"", data_in_length: int = 0, timeout: float = DEFAULT_TIMEOUT_S
    ) -> Reply:
        """Send one command and return the device's answer.

        After CHECK CONDITION the answer has sense data. A command moves data in one direction: data_out to the device,
        or up to data_in_length bytes from it.
        Raises TransportError when the connection fails or the time-out (s) expires, SettingsError for a command that no
        bus can carry.
        """
        ...

    def close(self) -> None:
        """Close the connection. Safe to call twice."""
        ...


class Target(Protocol):
    """The device's side of a bus: it answers commands."""

    def execute(self, cdb: bytes, data_out: bytes, data_in_length: int) -> Reply:
        """Answer one command. Sense data is not included: the initiator sends REQUEST SENSE."""
        ...
