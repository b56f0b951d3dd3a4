"""The ways to a SCSI device, all behind one interface."""

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
    data    what the device sent, never more than was asked for; shorter when it sent less.
    sense   sense data that came with CHECK CONDITION, empty otherwise.
    """

    status: int
    data: bytes = b""
    sense: bytes = b""


class Transport(Protocol):
    """One device at the end of a bus.

    max_transfer  most bytes that one command may carry; larger blocks are read in chunks.
    """

    max_transfer: int

    def execute(
        self, cdb: bytes, data_out: bytes = b"", data_in_length: int = 0, timeout: float = DEFAULT_TIMEOUT_S
    ) -> Reply:
        """Send one command and return the device's answer; sense data is fetched when there is any.

        Data goes one way in one command: data_out to the device, or up to data_in_length bytes from it.
        Raises TransportError when the way to the device fails or the time (s) is over, SettingsError for a command
        that no bus could carry.
        """
        ...

    def close(self) -> None:
        """Let the device go. Safe to call twice."""
        ...


class Target(Protocol):
    """The device's side of a bus: what answers commands."""

    def execute(self, cdb: bytes, data_out: bytes, data_in_length: int) -> Reply:
        """Answer one command. No sense data is fetched: the initiator asks for it with REQUEST SENSE."""
        ...
