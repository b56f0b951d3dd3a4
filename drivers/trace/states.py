"""Finds the state in status blocks before a release, after it, and with images ready."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from drivers.trace.exchanges import Exchange
from drivers.trace.roles import Guess
from drivers.vivid900.profile.template import Checksum


@dataclass(frozen=True)
class States:
    """The byte of the state in a status block, and its values; `data` unless as ready."""

    at: int
    values: dict[str, int]


def find_states(exchanges: Sequence[Exchange], guesses: Sequence[Guess], checksum: Checksum | None) -> States | None:
    """Return the first byte that changes with every release, capture and before images."""
    courses = list(_courses(exchanges, guesses))
    if not courses:
        return None
    taken = range(checksum.at, checksum.span.end) if checksum else range(0)
    for at in range(min(len(block) for course in courses for block in course)):
        values = {tuple(block[at] for block in course) for course in courses}
        ready, busy, data = next(iter(values))
        if at not in taken and len(values) == 1 and busy not in (ready, data):
            return States(at, {"ready": ready, "busy": busy} | ({} if data == ready else {"data": data}))
    return None


def _courses(exchanges: Sequence[Exchange], guesses: Sequence[Guess]) -> Iterator[tuple[bytes, bytes, bytes]]:
    """Yield three statuses of every capture: before the first release, after its own, last.

    Before later releases the scanner still has the images of the capture before.
    """
    role_of = {exchange.number: guess.role for guess in guesses for exchange in guess.group.exchanges}
    before, after, released, is_first = b"", list[bytes](), False, True
    for exchange in exchanges:
        role = role_of.get(exchange.number)
        if role == "release":
            released, is_first, after = True, False, []
        elif role == "status" and released:
            after.append(exchange.data)
        elif role == "status" and is_first:
            before = exchange.data
        elif role in ("read_pitch", "read_colour") and released:
            released = False
            if before and len(after) > 1:
                yield before, after[0], after[-1]
