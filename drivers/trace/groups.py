"""Groups commands of one kind, and finds constant bytes, type, length and offset fields."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Literal, NamedTuple

from drivers.scsi.commands import STANDARD
from drivers.trace.exchanges import Exchange
from drivers.vivid900.profile.template import Order

# Where CDBs of the standard have the transfer length (SCSI-2 §7.2.1; READ and SEND of scanners, §15.2).
USUAL_LENGTH: dict[int, tuple[int, int]] = {6: (4, 1), 10: (6, 3), 12: (6, 4), 16: (10, 4)}
MAX_FIELD = 4  # bytes
FIRST_FIELD = 2  # byte 0 is the operation code; byte 1 holds flags, and the unit in SCSI-2
MAX_TYPES = 8  # values of a type byte; a byte with more of them counts something
SMALL = 1024  # bytes; blocks of parameters and of status are smaller, images are much larger


class Span(NamedTuple):
    """A field of a CDB: its first byte, its number of bytes, its byte order."""

    at: int
    size: int
    order: Order = "big"

    @property
    def end(self) -> int:
        """One past its last byte."""
        return self.at + self.size

    @property
    def text(self) -> str:
        """Width and order in the notation of a profile: `3<`."""
        return f"{self.size}{'<' if self.order == 'little' else ''}"

    def of(self, cdb: bytes) -> int:
        """The number in a CDB."""
        return int.from_bytes(cdb[self.at : self.end], self.order)


@dataclass(frozen=True)
class Group:
    """Exchanges with the same operation code, type bytes and shape.

    The shape is CDB length and direction; they are in their order, at least one.
    order: byte order that is tried first.
    starts: numbers of the exchanges before which another command came.
    """

    exchanges: tuple[Exchange, ...]
    order: Order = "big"
    starts: frozenset[int] = frozenset()

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

    @cached_property
    def unexplained(self) -> frozenset[int]:
        """Offsets of the CDB's bytes that vary and belong to neither length nor offset."""
        spans = [span for span in (self.length, self.offset) if span]
        return self.varying - {place for span in spans for place in range(span.at, span.end)}

    @property
    def pattern(self) -> str:
        """The CDB in hexadecimal, `..` for bytes that vary."""
        cdb = self.exchanges[0].cdb
        return " ".join(".." if place in self.varying else f"{byte:02X}" for place, byte in enumerate(cdb))

    @cached_property
    def length(self) -> Span | None:
        """Return the CDB's field with the transfer length, None when no field fits all exchanges."""
        if self.direction == "none":
            return None
        return next((span for span in self._spans() if self._says_length(span)), None)

    @cached_property
    def offset(self) -> Span | None:
        """Return the field of the CDB that holds the offset.

        None unless blocks were read in pieces by their offsets.
        """
        free = (span for span in self._spans() if not _overlap(span, self.length))
        return next((span for span in free if self._says_offset(span)), None)

    @cached_property
    def blocks(self) -> tuple[tuple[Exchange, ...], ...]:
        """The pieces of every block that was moved.

        A piece at offset 0 begins a block. Without offsets large pieces follow each other until another command comes,
        or after one that is shorter than the first.
        """
        found: list[list[Exchange]] = []
        for exchange in self.good:
            if self._begins(exchange, found[-1] if found else []):
                found.append([])
            found[-1].append(exchange)
        return tuple(map(tuple, found))

    @cached_property
    def largest(self) -> int:
        """Bytes of the largest block, over all of its pieces."""
        return max((sum(piece.moved for piece in block) for block in self.blocks), default=0)

    def _begins(self, exchange: Exchange, block: Sequence[Exchange]) -> bool:
        if not block:
            return True
        if self.offset:
            return self.offset.of(exchange.cdb) == 0
        done = block[-1].asked < block[0].asked or block[0].asked <= SMALL
        return done or exchange.asked > block[0].asked or exchange.number in self.starts

    def _spans(self) -> Iterator[Span]:
        """Yield every place of a field.

        The usual one, then the widest from the left; those with the control byte last.
        """
        size = len(self.exchanges[0].cdb)
        orders: tuple[Order, Order] = ("big", "little") if self.order == "big" else ("little", "big")
        for order in orders:
            if size in USUAL_LENGTH:
                yield Span(*USUAL_LENGTH[size], order)
            for last in (size - 1, size):
                for width in range(MAX_FIELD, 0, -1):
                    yield from (Span(start, width, order) for start in range(FIRST_FIELD, last - width + 1))

    def _says_length(self, span: Span) -> bool:
        return all(span.of(exchange.cdb) == exchange.asked for exchange in self.exchanges)

    def _says_offset(self, span: Span) -> bool:
        """Whether it is 0 or where the piece before ended, and not always 0."""
        starts = [span.of(exchange.cdb) for exchange in self.good]
        ends = [0, *(start + exchange.moved for start, exchange in zip(starts, self.good, strict=True))]
        return any(starts) and all(start in (0, end) for start, end in zip(starts, ends, strict=False))


def group(exchanges: Sequence[Exchange]) -> tuple[Group, ...]:
    """Exchanges of a kind together, in the order in which each kind was first seen.

    An operation code that serves several kinds is split by its type bytes: those that vary between few values and are
    neither length nor offset.
    """
    kinds: dict[tuple[int, int, str], list[Exchange]] = {}
    for exchange in exchanges:
        kinds.setdefault((exchange.cdb[0], len(exchange.cdb), exchange.direction), []).append(exchange)
    order = _order([Group(tuple(kind)) for kind in kinds.values()])
    split = [part for kind in kinds.values() for part in _by_type(Group(tuple(kind), order))]
    split.sort(key=lambda part: part.exchanges[0].number)
    starts = _starts(exchanges, split)
    return tuple(replace(part, starts=starts) for part in split)


def _order(groups: Sequence[Group]) -> Order:
    """Return the byte order of those lengths that can be read in one order only."""
    orders = Counter(kind.length.order for kind in groups if kind.length and len(kind.lengths) > 1)
    return "little" if orders["little"] > orders["big"] else "big"


def _by_type(whole: Group) -> list[Group]:
    """A group for every value of the type bytes."""
    places = sorted(whole.unexplained)
    kinds: dict[bytes, list[Exchange]] = {}
    for exchange in whole.exchanges:
        kinds.setdefault(bytes(exchange.cdb[place] for place in places), []).append(exchange)
    if not 1 < len(kinds) <= MAX_TYPES:
        return [whole]
    return [Group(tuple(kind), whole.order) for kind in kinds.values()]


def _starts(exchanges: Sequence[Exchange], groups: Sequence[Group]) -> frozenset[int]:
    """Numbers of the exchanges that another command of the vendor's came before."""
    kind_of = {exchange.number: index for index, kind in enumerate(groups) for exchange in kind.exchanges}
    vendors = [exchange.number for exchange in exchanges if exchange.cdb[0] not in STANDARD]
    return frozenset(after for before, after in pairwise(vendors) if kind_of[before] != kind_of[after])


def _overlap(one: Span, other: Span | None) -> bool:
    return other is not None and one.at < other.end and other.at < one.end
