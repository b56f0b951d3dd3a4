"""Compares captures that differ in one setting, to find the field that has it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from itertools import groupby

from drivers.scsi.commands import STANDARD
from drivers.trace import CaptureError
from drivers.trace.exchanges import Exchange
from drivers.trace.groups import SMALL, Group
from drivers.trace.roles import Guess, guess_roles
from drivers.vivid900.profile.commands import AUTO_THRESHOLD, RANGES
from drivers.vivid900.profile.template import MAX_WIDTH, Checksum, Order, Span

SCALES = {"distance_mm": (1, 10, 100)}  # millimetres, tenths, hundredths; the other settings are small numbers
Key = tuple[str, str]
"""Role and first bytes of a kind of command, and which of its bytes: "command", "sent" or "answer"."""


def bytes_of(exchanges: Sequence[Exchange]) -> dict[Key, tuple[bytes, ...]]:
    """Return CDBs and blocks of every kind of command.

    Each once in their order; those of the standard and images excluded.
    """
    found = {}
    for guess in guess_roles([exchange for exchange in exchanges if exchange.cdb[0] not in STANDARD]):
        name = f"{guess.role or '?'} ({_opening(guess)})"
        for what, seen in _parts(guess):
            if any(seen):
                found[name, what] = tuple(dict.fromkeys(seen))
    return found


def _opening(guess: Guess) -> str:
    """Return the constant bytes of a kind of command, without length and offset."""
    return _without_fields(guess.group, guess.group.exchanges[0].cdb)[:3].hex(" ").upper()


def _without_fields(kind: Group, cdb: bytes) -> bytes:
    """A CDB with zeros for length and offset."""
    fields = {place for span in (kind.length, kind.offset) if span for place in range(span.at, span.end)}
    return bytes(0 if place in fields else byte for place, byte in enumerate(cdb))


def _parts(guess: Guess) -> Iterator[tuple[str, list[bytes]]]:
    kind = guess.group
    if kind.direction != "in":
        yield "sent", [exchange.data for exchange in kind.good]
    elif kind.largest <= SMALL:
        yield "answer", [exchange.data for exchange in kind.good]
    yield "command", [_without_fields(kind, exchange.cdb) for exchange in kind.good]


def list_changes(first: Sequence[Exchange], second: Sequence[Exchange]) -> Iterator[str]:
    """Yield a line for every run of bytes with other values.

    In the second capture; counters and checksums have such, too.
    """
    mine, theirs = bytes_of(first), bytes_of(second)
    lines = [line for key in mine if key in theirs for line in _changes(key, mine[key], theirs[key])]
    lines += [f"{_name(key)}: only in the first capture" for key in mine if key not in theirs]
    lines += [f"{_name(key)}: only in the second capture" for key in theirs if key not in mine]
    yield from lines or ["no byte of a command or of a block differs"]


def _changes(key: Key, one: Sequence[bytes], other: Sequence[bytes]) -> Iterator[str]:
    for start, end in _changed_runs(one, other):
        before, after = _only(one, other, start, end), _only(other, one, start, end)
        yield f"{_name(key)}, {_places(start, end)}: {' | '.join(before) or '-'} → {' | '.join(after) or '-'}"


def _changed_runs(one: Sequence[bytes], other: Sequence[bytes]) -> list[tuple[int, int]]:
    """Runs [start, end) of bytes whose values are not the same set in both."""
    shortest = min(map(len, (*one, *other)))
    changed = [at for at in range(shortest) if {data[at] for data in one} != {data[at] for data in other}]
    runs = [[at for _, at in run] for _, run in groupby(enumerate(changed), lambda pair: pair[1] - pair[0])]
    return [(run[0], run[-1] + 1) for run in runs]


def _only(one: Sequence[bytes], other: Sequence[bytes], start: int, end: int) -> list[str]:
    theirs = {data[start:end] for data in other}
    return [part.hex(" ") for part in dict.fromkeys(data[start:end] for data in one) if part not in theirs]


def _name(key: Key) -> str:
    return f"{key[0]} {key[1]}"


def _places(start: int, end: int) -> str:
    return f"byte {start}" if end == start + 1 else f"bytes {start} to {end - 1}"


def find_field(captures: Sequence[Sequence[Exchange]], setting: str, values: Sequence[int]) -> list[tuple[Key, Span]]:
    """Find the field of a setting that had these values in these captures.

    In every capture the field has that capture's value, and no other's but one that all captures have. Of fields within
    each other the narrowest that holds the whole range of the setting is named.
    Returns the bytes of a kind of command, and the field. Raises CaptureError for values that do not decide.
    """
    if len(captures) != len(values) or len(set(values)) < 2:
        raise CaptureError("a field is found by values that differ, one for each capture", "name each capture's value")
    known = [bytes_of(exchanges) for exchanges in captures]
    found = []
    for key in known[0]:
        if all(key in one for one in known):
            fields = _fields([one[key] for one in known], setting, values)
            found += [(key, span) for span in fields]
    return found


def _fields(seen: Sequence[Sequence[bytes]], setting: str, values: Sequence[int]) -> list[Span]:
    shortest = min(len(data) for one in seen for data in one)
    most = max(*RANGES.get(setting, (0, 0)), *values)
    most = AUTO_THRESHOLD if setting == "threshold" else most
    whole = [span for span in _whole_bytes(shortest, SCALES.get(setting, (1,)), most) if _fits(span, seen, values)]
    spans = whole or [span for span in _bits(shortest, most) if _fits(span, seen, values)]
    return [span for span in spans if not any(_is_within(other, span) for other in spans)]


ORDERS: tuple[Order, ...] = ("big", "little")


def _whole_bytes(length: int, scales: Sequence[int], most: int) -> Iterator[Span]:
    for scale in scales:
        for width in range(1, MAX_WIDTH // 2 + 1):
            for order in ORDERS[: 2 if width > 1 else 1]:
                spans = (Span(at=at, bytes=width, order=order, scale=scale) for at in range(length - width + 1))
                yield from (span for span in spans if span.holds(most))


def _bits(length: int, most: int) -> Iterator[Span]:
    bits = max(1, most.bit_length())
    for at in range(length if bits < 8 else 0):
        yield from (Span(at=at, low_bit=low, bits=bits) for low in range(8 - bits + 1))


def _fits(span: Span, seen: Sequence[Sequence[bytes]], values: Sequence[int]) -> bool:
    """Return whether a field has in every capture its value.

    And another's only where all captures have that: this one value is how the program found the scanner, or left it;
    that of another capture cannot be in all as well.
    """
    read = [{span.read(data, "big") for data in one} for one in seen]
    exact = all(span.scale == 1 or _exact(span, data) for one in seen for data in one)
    common = set.intersection(*read) & set(values)
    own = zip(read, values, strict=True)
    return (
        exact
        and len(common) <= 1
        and all(value in found and (found - common) & set(values) <= {value} for found, value in own)
    )


def _exact(span: Span, data: bytes) -> bool:
    """Whether a scaled number is a whole number of the setting's unit."""
    raw = span.model_copy(update={"scale": 1}).read(data, "big")
    return raw % span.scale == 0


def _is_within(inner: Span, outer: Span) -> bool:
    """Whether a field says the same in fewer bytes."""
    narrower = inner.bytes < outer.bytes or (inner.bits or 8) < (outer.bits or 8)
    return narrower and outer.at <= inner.at and inner.end <= outer.end


def list_field(captures: Sequence[Sequence[Exchange]], setting: str, values: Sequence[int]) -> Iterator[str]:
    """Yield a line, in a profile's notation, for every place where the setting may be."""
    found = find_field(captures, setting, values)
    for key, span in sorted(found, key=lambda place: place[0][1] != "sent"):
        yield f"{_name(key)}: {setting} = {inline_table(span)}"
    if not found:
        yield f"no field has {', '.join(map(str, values))} in these captures: was {setting} set, and nothing else?"


def inline_table(part: Span | Checksum) -> str:
    """A field or a checksum in a profile's notation."""
    values = part.model_dump(exclude_defaults=True)
    if values.get("order") == "big":
        del values["order"]
    return f"{{ {', '.join(f'{name} = {json.dumps(value)}' for name, value in values.items())} }}"
