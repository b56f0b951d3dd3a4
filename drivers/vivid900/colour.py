"""The colour image as the scanner sends it: 640×480 in every mode, eight or ten bits to a channel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.vivid900.commands import ShotMode
from drivers.vivid900.errors import BadReply
from drivers.vivid900.profile import ColourEncoding, Profile
from restore.vivid import TEXTURE_COLS, TEXTURE_ROWS

_ONE_CHANNEL = (ShotMode.MONITOR, ShotMode.RED, ShotMode.GREEN, ShotMode.BLUE)
MAX_TEN_BIT = 1023

Samples = NDArray[np.unsignedinteger[Any]]


@dataclass(frozen=True, eq=False)
class ColourImage:
    """pixels (480, 640, 3) RGB, or (480, 640, 1) of a single channel; uint8, or uint16 up to 1023 in ten-bit shots.

    shot  which shot since power-on it is of.
    """

    pixels: Samples
    shot: int = 0


def channels_of(mode: ShotMode) -> int:
    """Channels of a mode's colour image: one for the monitor and for single colours."""
    return 1 if mode in _ONE_CHANNEL else 3


def colour_length(profile: Profile, mode: ShotMode) -> int:
    """Bytes of the colour image of a mode, header and all."""
    return profile.blocks.colour.length + _payload(profile, mode)


def _payload(profile: Profile, mode: ShotMode) -> int:
    return TEXTURE_ROWS * TEXTURE_COLS * channels_of(mode) * _sample(profile.colour, mode).itemsize


def build_colour(profile: Profile, mode: ShotMode, image: ColourImage) -> bytes:
    """The colour image in bytes."""
    encoding = profile.colour
    pixels = image.pixels[..., _order(encoding)] if channels_of(mode) == 3 else image.pixels
    if encoding.layout == "planar":
        pixels = np.moveaxis(pixels, 2, 0)
    header = {"shot": image.shot, "rows": TEXTURE_ROWS, "cols": TEXTURE_COLS}
    return profile.blocks.colour.build(header, pixels.astype(_sample(encoding, mode)).tobytes())


def parse_colour(profile: Profile, mode: ShotMode, data: bytes) -> ColourImage:
    """Read the colour image of a mode. Raises BadReply when the length, the header or the checksum is wrong."""
    encoding, channels = profile.colour, channels_of(mode)
    values = profile.blocks.colour.parse(data, payload=_payload(profile, mode))
    if (values["rows"], values["cols"]) != (TEXTURE_ROWS, TEXTURE_COLS):
        raise BadReply(f"a colour image of {values['cols']}×{values['rows']} pixels came")
    samples = np.frombuffer(data, _sample(encoding, mode), offset=profile.blocks.colour.length)
    if encoding.layout == "planar":
        pixels = np.moveaxis(samples.reshape(channels, TEXTURE_ROWS, TEXTURE_COLS), 0, 2)
    else:
        pixels = samples.reshape(TEXTURE_ROWS, TEXTURE_COLS, channels)
    if channels == 3:
        pixels = pixels[..., np.argsort(_order(encoding))]
    if mode is ShotMode.COLOUR_10 and pixels.max() > MAX_TEN_BIT:
        raise BadReply(f"a ten-bit colour of {pixels.max()} came")
    return ColourImage(np.ascontiguousarray(pixels, pixels.dtype.newbyteorder("=")), values["shot"])


def _order(encoding: ColourEncoding) -> list[int]:
    return ["RGB".index(channel) for channel in encoding.channels]


def _sample(encoding: ColourEncoding, mode: ShotMode) -> np.dtype[Any]:
    wide = ">u2" if encoding.order == "big" else "<u2"
    return np.dtype(wide if mode is ShotMode.COLOUR_10 else np.uint8)
