"""Groups commands of one kind and finds their constant bytes, length field and offset field."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from drivers.vivid900.trace.exchanges import Exchange

Span = tuple[int, int]
"""A field of a CDB: its first byte, its number of bytes."""

# Where CDBs of the standard have the transfer length (SCSI-2 §7.2.1; READ and SEND of scanners, §15.2).
USUAL_LENGTH: dict[int, Span] = {6: (4, 1), 10: (6, 3), 12: (6, 4), 16: (10, 4)}
MAX_FIELD = 4  # bytes
FIRST_FIELD = 2  # byte 0 is the operation code; byte 1 holds flags, and the unit in SCSI-2


@dataclass(frozen=True)
class Group:
    """Exchanges with the same operation code, CDB length and direction, in their order; at least one."""

    exchanges: tuple[Exchange, ...]

    @property
    def opcode(self) -> int:
        return self.exchanges[0].cdb[0]

    @property
    def direction(self) -> Literal["none", "in", "out"]:
        return self.exchanges[0].direction

    @cached_property
    def good(self) -> tuple[Exchange, ...]:
        return tuple(exchange for exchange in self.exchanges if exchange.outcome == "good")

    @cached_property
    def lengths(self) -> tuple[int, ...]:
        """The different numbers of bytes asked for, ascending."""
        return tuple(sorted({exchange.asked for exchange in self.exchanges}))

    @cached_property
    def varying(self) -> frozenset[int]:
        """Offsets of the CDB's bytes that vary."""
        columns = zip(*(exchange.cdb for exchange in self.exchanges), strict=True)
        return frozenset(place for place, column in enumerate(columns) if len(set(column)) > 1)

    @property
    def pattern(self) -> str:
        """The CDB in hexadecimal, `..` for bytes that vary."""
        cdb = self.exchanges[0].cdb
        return " ".join(".." if place in self.varying else f"{byte:02X}" for place, byte in enumerate(cdb))

    @cached_property
    def length(self) -> Span | None:
        """The field of the CDB that holds the transfer length, None when no field fits all exchanges."""
        if self.direction == "none":
            return None
        size = len(self.exchanges[0].cdb)
        spans = [USUAL_LENGTH[size]] if size in USUAL_LENGTH else []
        return next((span for span in (*spans, *_spans(size)) if self._says_length(span)), None)

    @cached_property
    def offset(self) -> Span | None:
        """The field of the CDB that holds the offset, None unless blocks were read in pieces."""
        free = [span for span in _spans(len(self.exchanges[0].cdb)) if not _overlap(span, self.length)]
        return next((span for span in free if self._says_offset(span)), None)

    @cached_property
    def largest(self) -> int:
        """Bytes of the largest block, over all of its pieces."""
        offset = self.offset
        return max((e.moved + (value(e.cdb, offset) if offset else 0) for e in self.good), default=0)

    def _says_length(self, span: Span) -> bool:
        return all(value(exchange.cdb, span) == exchange.asked for exchange in self.exchanges)

    def _says_offset(self, span: Span) -> bool:
        """Whether it is 0 or where the piece before ended, and not always 0."""
        starts = [value(exchange.cdb, span) for exchange in self.good]
        ends = [0, *(start + exchange.moved for start, exchange in zip(starts, self.good, strict=True))]
        return any(starts) and all(start in (0, end) for start, end in zip(starts, ends, strict=False))


def value(cdb: bytes, span: Span) -> int:
    """The number in a field, big-endian as all of the standard."""
    return int.from_bytes(cdb[span[0] : sum(span)], "big")


def group(exchanges: Sequence[Exchange]) -> tuple[Group, ...]:
    """Exchanges of a kind together, in the order in which each kind was first seen."""
    kinds: dict[tuple[int, int, str], list[Exchange]] = {}
    for exchange in exchanges:
        kinds.setdefault((exchange.cdb[0], len(exchange.cdb), exchange.direction), []).append(exchange)
    return tuple(Group(tuple(kind)) for kind in kinds.values())


def _spans(size: int) -> Iterator[Span]:
    """Every place of a field in a CDB, the widest first, then from the left."""
    for width in range(MAX_FIELD, 0, -1):
        yield from ((start, width) for start in range(FIRST_FIELD, size - width + 1))


def _overlap(one: Span, other: Span | None) -> bool:
    return other is not None and one[0] < sum(other) and other[0] < sum(one)
