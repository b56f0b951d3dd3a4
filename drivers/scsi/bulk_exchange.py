"""One command over Bulk-Only: the command wrapper, the data, the status wrapper.

Source: USB Mass Storage Class, Bulk-Only Transport, revision 1.0, §5.3 (figure 2: status) and §6.7 (thirteen cases).
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from dataclasses import dataclass

from drivers.scanner import TransportError
from drivers.scsi.bulk_only import (
    FAILED,
    PASSED,
    PHASE_ERROR,
    STATUS_LENGTH,
    STATUS_SIGNATURE,
    CommandWrapper,
    StatusWrapper,
    build_command,
    parse_status,
)
from drivers.scsi.pipes import Pipes, Stall
from drivers.scsi.transport import CHECK_CONDITION, GOOD, Reply

NO_SUCH_TARGET = 0x8A  # the USB2Xchange's own status for a SCSI ID without a device


class NoSuchTarget(TransportError):
    """Raised when no device answers at the SCSI ID. The bridge itself needs no recovery."""


class Deadline:
    """The time limit of one command, over all its phases."""

    def __init__(self, clock: Callable[[], float], seconds: float) -> None:
        self._clock, self._end = clock, clock() + seconds

    def left_ms(self) -> int:
        """Milliseconds left, at least 1: 0 means no limit to libusb."""
        return max(1, round((self._end - self._clock()) * 1000))


@dataclass(frozen=True)
class _Arrived:
    """Data of the data phase.

    whole  whether `data` is known to be exactly what was transferred. After a stall it is the whole buffer, and only
           the residue gives the number of valid bytes.
    """

    data: bytes
    whole: bool = True


def run_command(pipes: Pipes, wrapper: CommandWrapper, data_out: bytes, deadline: Deadline) -> Reply:
    """Send one command, move its data, read its status.

    Raises TransportError when the bridge fails or violates the protocol. The pipes then need reset recovery.
    """
    try:
        _send_command(pipes, wrapper, deadline)
        if data_out:
            _send_data(pipes, data_out, deadline)
        arrived = _read_data(pipes, wrapper, deadline) if wrapper.from_device else _Arrived(b"")
        if _is_status(arrived.data, wrapper.tag):  # the USB2Xchange skips the data phase when a command fails
            status, arrived = parse_status(arrived.data), _Arrived(b"")
        else:
            status = _read_status(pipes, wrapper, deadline)
    except Stall as stall:
        raise TransportError(f"{stall}: the bridge refuses", "try again") from stall
    _check_status(status, wrapper)
    return _reply(status, wrapper, arrived)


def _send_command(pipes: Pipes, wrapper: CommandWrapper, deadline: Deadline) -> None:
    block = build_command(wrapper)
    sent = pipes.write(block, deadline.left_ms())
    if sent != len(block):
        raise TransportError(f"the bridge took only {sent} of {len(block)} bytes of a command", "try again")


def _send_data(pipes: Pipes, data: bytes, deadline: Deadline) -> None:
    """Send the data; how much of it the device took is in the residue."""
    try:
        pipes.write(data, deadline.left_ms())
    except Stall:
        pipes.clear_out()


def _read_data(pipes: Pipes, wrapper: CommandWrapper, deadline: Deadline) -> _Arrived:
    buffer = array("B", bytes(max(wrapper.length, STATUS_LENGTH)))  # so that a status in place of data fits
    try:
        came = _read(pipes, buffer, wrapper, deadline)
    except Stall:
        pipes.clear_in()
        return _Arrived(buffer[: wrapper.length].tobytes(), whole=False)
    return _Arrived(buffer[:came].tobytes())


def _read(pipes: Pipes, buffer: array[int], wrapper: CommandWrapper, deadline: Deadline) -> int:
    """Fill the buffer and return the number of bytes.

    A repeated status of the previous command is skipped.
    """
    came = pipes.read(buffer, deadline.left_ms())
    if _is_status(buffer[:came].tobytes(), wrapper.tag - 1):
        came = pipes.read(buffer, deadline.left_ms())
    return came


def _is_status(data: bytes, tag: int) -> bool:
    """Whether these bytes are the status wrapper of the command with this tag."""
    return len(data) == STATUS_LENGTH and data[:8] == STATUS_SIGNATURE + tag.to_bytes(4, "little")


def _read_status(pipes: Pipes, wrapper: CommandWrapper, deadline: Deadline) -> StatusWrapper:
    """Read the status; after a halt, once more (§5.3, figure 2)."""
    buffer = array("B", bytes(STATUS_LENGTH))
    try:
        came = _read(pipes, buffer, wrapper, deadline)
    except Stall:
        pipes.clear_in()
        came = _read(pipes, buffer, wrapper, deadline)
    return parse_status(buffer[:came].tobytes())


def _check_status(status: StatusWrapper, wrapper: CommandWrapper) -> None:
    """Raise TransportError unless the status fits this command (§6.3)."""
    if status.tag != wrapper.tag:
        raise TransportError("the bridge answers another command", "try again")
    if status.status == PHASE_ERROR:
        raise TransportError("the bridge lost its place (phase error)", "try again")
    if status.status == NO_SUCH_TARGET:
        raise NoSuchTarget("no device answers at this SCSI ID", "check the scanner's power, cable and SCSI ID")
    if status.status not in (PASSED, FAILED):
        raise TransportError(f"the bridge reports status {status.status:#04x}", "plug it in again and start over")
    if status.residue > wrapper.length:
        raise TransportError(f"{status.residue} of {wrapper.length} bytes are said to be missing", "try again")


def _reply(status: StatusWrapper, wrapper: CommandWrapper, arrived: _Arrived) -> Reply:
    passed, moved = status.status == PASSED, wrapper.length - status.residue
    if wrapper.from_device:
        length_known = len(arrived.data) <= wrapper.length and (arrived.whole or status.residue > 0)
        if passed and not length_known:
            raise TransportError("the bridge's data and its status contradict each other", "try again")
        return Reply(GOOD if passed else CHECK_CONDITION, arrived.data[:moved] if length_known else b"")
    if passed and status.residue:
        raise TransportError(f"the device took only {moved} of {wrapper.length} bytes", "try again")
    return Reply(GOOD if passed else CHECK_CONDITION)
