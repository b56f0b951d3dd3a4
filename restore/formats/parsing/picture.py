"""Colour images of a scan, as (h, w, 3) uint8 RGB."""

from __future__ import annotations

import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, UnidentifiedImageError

from restore.errors import BadInput
from restore.formats.parsing.png import png_parts
from restore.formats.parsing.source import CUT_SHORT, is_file, read_bytes, scan_stem
from restore.runtime.arguments import checks_types
from restore.scan import Bytes

# The scanner's own image has 0.3 million pixels; this leaves room for a photograph, and is 240 MB of RGB.
MAX_PIXELS = 80_000_000
# A photograph has four pixels to a byte at most; what is packed closer, and is not small, was made to fill the memory.
SMALL_PIXELS, MAX_PIXELS_PER_BYTE = 20_000_000, 16
BAND_ROWS = 256
KINDS = ("PNG", "PPM", "JPEG", "TIFF", "BMP", "WEBP")
# In the order of preference when several lie next to a scan: lossless first.
SUFFIXES = (".png", ".ppm", ".tif", ".tiff", ".bmp", ".jpg", ".jpeg", ".webp")

# TIFF 6.0, section 8: numbers of the tags, and their values where white is 0 and where every colour is stored apart.
BITS, PHOTOMETRIC, PLANES, SAMPLE_FORMAT = 258, 262, 284, 339
WHITE_IS_ZERO, SEPARATE, UNSIGNED = 0, 2, 1


@checks_types
def read_image(path: Path | str) -> Bytes:
    """Read a picture file as (h, w, 3) uint8 RGB.

    Raises BadInput when it is missing, damaged or too large.
    """
    return decode_picture(read_bytes(Path(path)), str(path))


def decode_picture(data: bytes, name: str) -> Bytes:
    """Decode a picture to (h, w, 3) uint8 RGB.

    name: of the picture, in errors.
    Raises BadInput.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Pillow warns of odd tags; unreadable pixels are an error all the same
        try:
            with Image.open(io.BytesIO(data), formats=KINDS) as image:
                check_size(image.width, image.height, len(data), name)
                _check_samples(image, name)
                return _rgb(image)
        except BadInput:
            raise
        except Exception as error:  # Pillow's decoders raise whatever they trip over
            if "truncated" in str(error).lower():
                raise BadInput(f"{name} seems cut short: it does not hold all its pixels", CUT_SHORT) from error
            reason = "its kind is not known" if isinstance(error, UnidentifiedImageError) else error
            raise BadInput(f"{name} is not a readable image: {reason}", f"use one of {', '.join(KINDS)}") from error


def check_size(width: int, height: int, size: int, name: str) -> None:
    """Raise BadInput for a picture of more pixels than are read from `size` bytes."""
    pixels = width * height
    if pixels > MAX_PIXELS or pixels > max(SMALL_PIXELS, MAX_PIXELS_PER_BYTE * size):
        raise BadInput(f"{name} has too many pixels: {width} × {height}", "scale it down")


def _check_samples(image: Image.Image, name: str) -> None:
    """Raise BadInput for samples that cannot be read reliably.

    Numbers on a scale that no tag states, and a TIFF that Pillow puts together wrongly.
    """
    tags: Any = getattr(image, "tag_v2", {})  # of TIFF alone
    bits, kind = tags.get(BITS, (8,)), tags.get(SAMPLE_FORMAT, (UNSIGNED,))
    grey = image.format == "TIFF" and image.mode.startswith("I") and (bits, kind) != ((16,), (UNSIGNED,))
    if image.mode == "F" or grey:
        raise BadInput(f"{name} is grey in other numbers than of 8 or 16 bits", "save it with 8 or 16 bits")
    if tags.get(PLANES) == SEPARATE and max(bits) > 8:
        raise BadInput(f"{name} has its colours in separate planes of {max(bits)} bits", "save it with 8 bits")


def _rgb(image: Image.Image) -> Bytes:
    """Convert a picture to (h, w, 3) uint8 RGB, in bands.

    Pillow's copies of the whole would take twice the memory.
    """
    out = np.empty((image.height, image.width, 3), np.uint8)
    tags: Any = getattr(image, "tag_v2", {})
    negative = tags.get(PHOTOMETRIC) == WHITE_IS_ZERO  # Pillow turns this round in pictures of 8 bits alone
    for top in range(0, image.height, BAND_ROWS):
        part = image.crop((0, top, image.width, min(top + BAND_ROWS, image.height)))
        if image.mode.startswith("I"):  # 16 bits of grey
            grey = np.clip(np.asarray(part).astype(np.int64) // 257, 0, 255)[..., None]
            out[top : top + BAND_ROWS] = 255 - grey if negative else grey
        else:
            out[top : top + BAND_ROWS] = np.asarray(part.convert("RGB"))
    return out


@checks_types
def encode_png(picture: Bytes, **chunks: Any) -> bytes:
    """Encode (h, w, 3) uint8 RGB as PNG, without loss.

    chunks: what Pillow's writer of PNG takes in addition.
    """
    return b"".join(png_parts(picture, **chunks))


def adjacent_picture(path: Path) -> Bytes | None:
    """Return the picture in the same folder with the name of the scan.

    Returns (h, w, 3), or None. Raises BadInput when it is damaged.
    """
    names = (path.with_name(scan_stem(path) + suffix) for suffix in SUFFIXES)
    return next((read_image(name) for name in names if is_file(name)), None)
