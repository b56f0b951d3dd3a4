"""Colour images of a scan, as (h, w, 3) uint8 RGB."""

from __future__ import annotations

import io
import warnings
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from restore.errors import BadInput
from restore.formats.source import is_file, read_bytes, scan_stem
from restore.scan import Bytes

# The scanner's own image has 0.3 million pixels; this leaves room for a photograph, and is 240 MB of RGB.
MAX_PIXELS = 80_000_000
KINDS = ("PNG", "PPM", "JPEG", "TIFF", "BMP")
# In the order of preference when several lie beside a scan: lossless first.
SUFFIXES = (".png", ".ppm", ".tif", ".tiff", ".bmp", ".jpg", ".jpeg")


def read_picture(path: Path) -> Bytes:
    """Read a picture file as (h, w, 3) uint8 RGB. Raises BadInput when it is missing, damaged or too large."""
    return decode_picture(read_bytes(Path(path)), str(path))


def decode_picture(data: bytes, name: str) -> Bytes:
    """Decode a picture to (h, w, 3) uint8 RGB; `name` denotes it in errors. Raises BadInput."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Pillow warns of odd tags; unreadable pixels are an error all the same
        try:
            with Image.open(io.BytesIO(data), formats=KINDS) as image:
                if image.width * image.height > MAX_PIXELS:
                    raise BadInput(f"{name} has too many pixels: {image.width} × {image.height}", "scale it down")
                return _rgb(image)
        except BadInput:
            raise
        except Exception as error:  # Pillow's decoders raise whatever they trip over
            reason = "its kind is not known" if isinstance(error, UnidentifiedImageError) else error
            raise BadInput(f"{name} is no readable picture: {reason}", f"use one of {', '.join(KINDS)}") from error


def _rgb(image: Image.Image) -> Bytes:
    if image.mode.startswith("I"):  # 16 bits of grey
        grey = np.clip(np.asarray(image).astype(np.int64) // 257, 0, 255).astype(np.uint8)
        return np.repeat(grey[..., None], 3, axis=2)
    return np.array(image.convert("RGB"), dtype=np.uint8)


def encode_png(picture: Bytes) -> bytes:
    """Encode (h, w, 3) uint8 RGB as PNG, without loss."""
    out = io.BytesIO()
    Image.fromarray(picture).save(out, "PNG")
    return out.getvalue()


def adjacent_picture(path: Path) -> Bytes | None:
    """The picture (h, w, 3) in the same folder with the name of the scan, if there is one.

    Raises BadInput when it is damaged.
    """
    names = (path.with_name(scan_stem(path) + suffix) for suffix in SUFFIXES)
    return next((read_picture(name) for name in names if is_file(name)), None)
