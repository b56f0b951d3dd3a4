"""The colour image as the scanner sends it.

It has 640×480 pixels in every mode, eight or ten bits to a channel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.scsi.errors import BadReply
from drivers.vivid900.profile.commands import ShotMode
from drivers.vivid900.profile.profile import Profile
from drivers.vivid900.profile.raster import Codec
from restore.vivid import TEXTURE_COLS, TEXTURE_ROWS

_ONE_CHANNEL = (ShotMode.MONITOR, ShotMode.RED, ShotMode.GREEN, ShotMode.BLUE)
MAX_TEN_BIT = 1023

Samples = NDArray[np.unsignedinteger[Any]]


@dataclass(frozen=True, eq=False)
class ColourImage:
    """Colour image of a shot.

    pixels: (480, 640, 3) RGB, or (480, 640, 1) of a single channel; uint8, or uint16 up to 1023 in ten-bit shots.
    shot: its number since power-on; None when the image does not say.
    """

    pixels: Samples
    shot: int | None = None


def channels_of(mode: ShotMode) -> str:
    """Return the channels of a colour image: RGB, or L for monitor and single colours."""
    return "L" if mode in _ONE_CHANNEL else "RGB"


def colour_length(profile: Profile, mode: ShotMode) -> int:
    """Bytes of the colour image of a mode, header and all."""
    return profile.blocks.colour.length + _image(profile, mode).length(TEXTURE_ROWS, TEXTURE_COLS)


def build_colour(profile: Profile, mode: ShotMode, image: ColourImage) -> bytes:
    """The colour image in bytes."""
    channels = dict(zip(channels_of(mode), np.moveaxis(image.pixels, 2, 0), strict=True))
    header = {"shot": image.shot or 0, "rows": TEXTURE_ROWS, "cols": TEXTURE_COLS}
    return profile.blocks.colour.build(header, _image(profile, mode).encode(channels))


def parse_colour(profile: Profile, mode: ShotMode, data: bytes) -> ColourImage:
    """Parse the colour image of a mode.

    Raises BadReply when the length, the header or the checksum is wrong.
    """
    header, image = profile.blocks.colour, _image(profile, mode)
    values = header.parse(data, payload=image.length(TEXTURE_ROWS, TEXTURE_COLS))
    rows, cols = values.get("rows", TEXTURE_ROWS), values.get("cols", TEXTURE_COLS)
    if (rows, cols) != (TEXTURE_ROWS, TEXTURE_COLS):
        raise BadReply(f"a colour image of {cols}×{rows} pixels came")
    try:
        channels = image.decode(data[header.length :], rows, cols)
    except ValueError as error:
        raise BadReply(f"cannot decode the colour image: {error}") from error
    kind = np.uint16 if mode is ShotMode.COLOUR_10 else np.uint8
    pixels: Samples = np.stack([channels[name] for name in channels_of(mode)], axis=2).astype(kind)
    if mode is ShotMode.COLOUR_10 and pixels.max() > MAX_TEN_BIT:
        raise BadReply(f"a ten-bit colour of {pixels.max()} came")
    return ColourImage(pixels, values.get("shot"))


def _image(profile: Profile, mode: ShotMode) -> Codec:
    return profile.colour.image(channels_of(mode), "u2" if mode is ShotMode.COLOUR_10 else "u1")
