"""Guesses the role of each kind of command from its data and order, with the evidence."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from drivers.scsi.commands import STANDARD
from drivers.trace.exchanges import Exchange
from drivers.trace.groups import SMALL, Group, group
from drivers.vivid900.geometry.lenses import MODES
from drivers.vivid900.profile.contents import CommandName

COLOUR_PIXELS = 640 * 480
COLOUR_SAMPLES = 3, 4  # bytes a pixel: 24 bits in every mode (hardware manual p. 59), or filled up to a word
PITCH_SAMPLES = range(4, 17)  # bytes a sample: from one word to four
HEADER_AT_MOST = 4096  # bytes that may come before an image in the same block


@dataclass(frozen=True)
class Guess:
    """A kind of command and its likely role; None without evidence."""

    group: Group
    role: CommandName | None
    evidence: str


def guess_roles(exchanges: Sequence[Exchange]) -> tuple[Guess, ...]:
    """A guess for every kind of command that is not one of the standard's three."""
    vendors = [exchange for exchange in exchanges if exchange.cdb[0] not in STANDARD]
    kinds = group(vendors)
    read = [kind for kind in kinds if kind.direction == "in"]
    images = [kind for kind in read if kind.largest > SMALL]
    blocks = {kind.lengths[-1] for kind in read if kind not in images}
    sent = [kind for kind in kinds if kind.direction == "out"]
    written = [kind for kind in sent if kind.lengths[-1] in blocks] or sent[:1]
    lengths = {length for kind in written for length in kind.lengths}
    return (
        *(Guess(kind, *_role(kind, images, lengths)) for kind in read),
        *(Guess(kind, "write_parameters", "sends a block") for kind in written),
        *_acting(vendors, images, [kind for kind in kinds if kind.direction != "in" and kind not in written]),
    )


def _role(kind: Group, images: Sequence[Group], written: set[int]) -> tuple[CommandName, str]:
    if kind not in images:
        if kind.lengths[-1] in written:
            return "read_parameters", "reads a block as long as one that is sent"
        return "status", "reads a small block"
    shape, is_first = colour_shape(kind), kind is images[0]
    others = [image for image in images if image is not kind and colour_shape(image)]
    if shape and not (is_first and others):
        return "read_colour", f"{kind.largest} bytes in all: {shape}"
    return "read_pitch", f"{kind.largest} bytes in all: {pitch_shape(kind) or 'of no size that is known'}"


@dataclass(frozen=True)
class Shape:
    """An image: rows, columns, bytes to a sample, bytes of the header before them."""

    rows: int
    cols: int
    sample: int
    header: int

    def __str__(self) -> str:
        return f"{self.sample} to a sample of {self.cols}×{self.rows}, and {self.header} before them"


def colour_shape(kind: Group) -> Shape | None:
    """The shape of blocks that are as long as a colour image, None for others."""
    headers = ((sample, kind.largest - sample * COLOUR_PIXELS) for sample in COLOUR_SAMPLES)
    return next((Shape(480, 640, sample, rest) for sample, rest in headers if 0 <= rest <= HEADER_AT_MOST), None)


def pitch_shape(kind: Group) -> Shape | None:
    """The shape of blocks that are as long as a range image, None for others."""
    for mode in MODES.values():
        sample, header = divmod(kind.largest, mode.rows * mode.cols)
        if sample in PITCH_SAMPLES and header <= HEADER_AT_MOST:
            return Shape(mode.rows, mode.cols, sample, header)
    return None


def _acting(vendors: Sequence[Exchange], images: Sequence[Group], kinds: Sequence[Group]) -> Iterator[Guess]:
    """Yield guesses for commands that read nothing.

    The one that comes before the images releases the shutter.
    """
    acting = [exchange for kind in kinds for exchange in kind.exchanges]
    before = Counter(cdb for cdb in _last_acting_before_images(vendors, images, acting) if cdb)
    releasing = before.most_common(1)[0][0] if before else None
    for cdb in dict.fromkeys(exchange.cdb for exchange in acting):
        kind = Group(tuple(exchange for exchange in acting if exchange.cdb == cdb))
        if cdb == releasing:
            yield Guess(kind, "release", f"the last command that reads nothing before each of {before[cdb]} images")
        else:
            yield Guess(kind, None, "reads nothing: passive_autofocus, active_autofocus or something else")


def _last_acting_before_images(
    vendors: Sequence[Exchange], images: Sequence[Group], acting: Sequence[Exchange]
) -> Iterator[bytes]:
    firsts = {block[0].number for kind in images for block in kind.blocks}
    numbers = {exchange.number for exchange in acting}
    last = b""
    for exchange in vendors:
        if exchange.number in numbers:
            last = exchange.cdb
        elif exchange.number in firsts:
            yield last
