"""Reassembles SCSI commands and their answers from the Bulk-Only transfers of a capture."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from drivers.scanner import TransportError
from drivers.scsi.bulk_only import (
    COMMAND_LENGTH,
    FAILED,
    PASSED,
    PHASE_ERROR,
    STATUS_LENGTH,
    CommandWrapper,
    StatusWrapper,
    parse_command,
    parse_status,
)
from drivers.scsi.commands import REQUEST_SENSE
from drivers.trace import CaptureError
from drivers.trace.packets import Transfer

HEAD_LENGTH = 64  # bytes shown of what a command moved: enough for a block of parameters or an image's header
MAX_KEPT = 64 << 20  # bytes kept of all images together: a dozen FINE shots; of those beyond, only the head

Outcome = Literal["good", "failed", "phase error", "unanswered"]
OUTCOMES: dict[int, Outcome] = {PASSED: "good", FAILED: "failed", PHASE_ERROR: "phase error"}


@dataclass(frozen=True)
class Exchange:
    """A command and its answer.

    number  its place in the capture.
    where   bus and device address of the bridge; lun: the wrapper's unit byte, which may hold the SCSI ID.
    asked   bytes that the wrapper announces; moved: bytes that were seen, without the residue.
    data    them, or their first bytes when the capture has very many; head: the first.
    sense   what the REQUEST SENSE right after it brought, empty when there was none.
    """

    where: tuple[int, int]
    lun: int
    cdb: bytes
    direction: Literal["none", "in", "out"]
    asked: int
    moved: int
    data: bytes
    outcome: Outcome
    sense: bytes = b""
    number: int = 0

    @property
    def head(self) -> bytes:
        return self.data[:HEAD_LENGTH]


class _Started:
    """A command whose status has not been seen yet."""

    def __init__(self, where: tuple[int, int], wrapper: CommandWrapper) -> None:
        self.wrapper = wrapper
        self._where, self._moved, self._data = where, 0, bytearray()

    @property
    def wants_data(self) -> bool:
        return not self.wrapper.from_device and self._moved < self.wrapper.length

    def add(self, transfer: Transfer, *, room: int) -> int:
        """Add a transfer; return how many of its bytes were kept, at least its head."""
        if transfer.inward != self.wrapper.from_device:
            return 0
        kept = transfer.data[: max(room, HEAD_LENGTH - len(self._data), 0)]
        self._data += kept if len(self._data) == self._moved else b""  # no gaps
        self._moved += transfer.length
        return len(kept)

    def ended(self, status: StatusWrapper | None) -> Exchange:
        wrapper = self.wrapper
        moved = min(self._moved, wrapper.length - status.residue) if status else self._moved
        return Exchange(
            where=self._where,
            lun=wrapper.lun,
            cdb=wrapper.cdb,
            direction="none" if not wrapper.length else "in" if wrapper.from_device else "out",
            asked=wrapper.length,
            moved=max(0, moved),
            data=bytes(self._data[: max(0, moved)]),
            outcome=OUTCOMES.get(status.status, "phase error") if status else "unanswered",
        )


def read_exchanges(transfers: Iterable[Transfer]) -> list[Exchange]:
    """Return every command of every bridge, in the order of their ends.

    Raises CaptureError without commands.
    """
    started: dict[tuple[int, int], _Started] = {}
    exchanges: list[Exchange] = []
    room = MAX_KEPT
    for transfer in transfers:
        current = started.get(transfer.where)
        if wrapper := _command(transfer, current):
            if current:
                exchanges.append(current.ended(None))
            started[transfer.where] = _Started(transfer.where, wrapper)
        elif current and (status := _status(transfer, current)):
            exchanges.append(started.pop(transfer.where).ended(status))
        elif current:
            room -= current.add(transfer, room=room)
    exchanges += [current.ended(None) for current in started.values()]
    if not exchanges:
        hint = "start the capture before the vendor's program, and use a bridge that speaks Bulk-Only"
        raise CaptureError("the capture has no SCSI commands in Bulk-Only wrappers", hint)
    return [replace(exchange, number=number) for number, exchange in enumerate(_with_sense(exchanges))]


def _command(transfer: Transfer, current: _Started | None) -> CommandWrapper | None:
    if transfer.inward or len(transfer.data) != COMMAND_LENGTH or (current and current.wants_data):
        return None
    try:
        return parse_command(transfer.data)
    except TransportError:
        return None


def _status(transfer: Transfer, current: _Started) -> StatusWrapper | None:
    if not transfer.inward or len(transfer.data) != STATUS_LENGTH:
        return None
    try:
        status = parse_status(transfer.data)
    except TransportError:
        return None
    return status if status.tag == current.wrapper.tag else None


def _with_sense(exchanges: Sequence[Exchange]) -> list[Exchange]:
    """Attach to each failed command the sense data of the REQUEST SENSE right after it."""
    following: dict[tuple[int, int], Exchange] = {}
    found = []
    for exchange in reversed(exchanges):
        after = following.get(exchange.where)
        following[exchange.where] = exchange
        asked = after and after.cdb[0] == REQUEST_SENSE and after.lun == exchange.lun
        found.append(
            replace(exchange, sense=after.head) if after and asked and exchange.outcome == "failed" else exchange
        )
    return found[::-1]
