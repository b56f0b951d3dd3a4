"""Guesses the role of each kind of command from the data that it moves and its order, with the evidence."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from drivers.vivid900.scsi import STANDARD
from drivers.vivid900.trace.exchanges import Exchange
from drivers.vivid900.trace.groups import Group, group, value

COLOUR_BYTES = 640 * 480 * 3  # the colour image has 24 bits a pixel in every mode (hardware manual p. 59)
HEADER_AT_MOST = 4096  # bytes that may come before an image in the same block
SMALL = 1024  # bytes; blocks of parameters and of status are smaller, images are much larger
SAMPLES = {"FINE": 640 * 480, "FAST": 320 * 240}


@dataclass(frozen=True)
class Guess:
    """A kind of command and its likely role; None without evidence."""

    group: Group
    role: str | None
    evidence: str


def guess_roles(exchanges: Sequence[Exchange]) -> tuple[Guess, ...]:
    """A guess for every kind of command that is not one of the standard's three."""
    vendors = [exchange for exchange in exchanges if exchange.cdb[0] not in STANDARD]
    moving = group([exchange for exchange in vendors if exchange.direction != "none"])
    written = {length for kind in moving if kind.direction == "out" for length in kind.lengths}
    guesses = [Guess(kind, *_role(kind, written)) for kind in moving]
    return (
        *guesses,
        *_still(vendors, [guess.group for guess in guesses if guess.role in ("read_pitch", "read_colour")]),
    )


def _role(kind: Group, written: set[int]) -> tuple[str, str]:
    if kind.direction == "out":
        return "write_parameters", "sends a block"
    if 0 <= kind.largest - COLOUR_BYTES <= HEADER_AT_MOST:
        return "read_colour", f"{kind.largest} bytes in all, as many as a colour image has"
    if kind.largest > SMALL:
        shares = " or ".join(f"{kind.largest / samples:.2f} to a sample of {mode}" for mode, samples in SAMPLES.items())
        return "read_pitch", f"{kind.largest} bytes in all, {shares}"
    if kind.lengths[-1] in written:
        return "read_parameters", "reads a block as long as one that is sent"
    return "status", "reads a small block"


def _still(vendors: Sequence[Exchange], images: Sequence[Group]) -> Iterator[Guess]:
    """Guesses for commands that move no data: the one that comes before the images releases the shutter."""
    still = [exchange for exchange in vendors if exchange.direction == "none"]
    before = Counter(cdb for cdb in _last_still_before_images(vendors, images) if cdb)
    releasing = before.most_common(1)[0][0] if before else None
    for cdb in dict.fromkeys(exchange.cdb for exchange in still):
        kind = Group(tuple(exchange for exchange in still if exchange.cdb == cdb))
        if cdb == releasing:
            yield Guess(kind, "release", f"the last command without data before each of {before[cdb]} images")
        else:
            yield Guess(kind, None, "moves no data: passive_autofocus, active_autofocus or something else")


def _last_still_before_images(vendors: Sequence[Exchange], images: Sequence[Group]) -> Iterator[bytes]:
    firsts = {id(exchange) for kind in images for exchange in kind.exchanges if _is_first_piece(kind, exchange)}
    last = b""
    for exchange in vendors:
        if exchange.direction == "none":
            last = exchange.cdb
        elif id(exchange) in firsts:
            yield last


def _is_first_piece(kind: Group, exchange: Exchange) -> bool:
    return kind.offset is None or value(exchange.cdb, kind.offset) == 0
