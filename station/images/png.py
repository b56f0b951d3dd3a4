"""PNG with resolution (chunk pHYs), colour profile (iCCP) and metadata (eXIf, iTXt)."""

from __future__ import annotations

from typing import Any, BinaryIO

from PIL.PngImagePlugin import PngInfo

from restore import formats
from restore.runtime import Rows
from restore.scan import Bytes
from station.images.image_metadata import ImageMetadata


def encode_png(image: Bytes, dpi: float | None = None, metadata: ImageMetadata | None = None) -> bytes:
    """Encode a picture (h, w, 3) uint8 RGB as a PNG file, as `write_png` writes it."""
    return b"".join(formats.png_parts(image, **_chunks(dpi, metadata)))


def write_png(image: Bytes | Rows, dpi: float | None, metadata: ImageMetadata | None, file: BinaryIO) -> None:
    """Write a picture (h, w, 3) uint8 RGB to a PNG file.

    With `dpi`, one inch of paper is `dpi` pixels. pHYs counts whole pixels a metre, so the tag is within 0.5 / 5906 of
    150 dpi (PNG specification, 11.3.4.3). One that is drawn by rows is never in memory whole.
    """
    for part in formats.png_parts(image, **_chunks(dpi, metadata)):
        file.write(part)


def _chunks(dpi: float | None, metadata: ImageMetadata | None) -> dict[str, Any]:
    """Return what Pillow's writer of PNG takes besides the picture."""
    tags: dict[str, Any] = {} if dpi is None else {"dpi": (dpi, dpi)}
    if metadata is not None:
        texts = PngInfo()
        texts.add_itxt("XML:com.adobe.xmp", metadata.xmp().decode("utf-8"))
        tags |= {"icc_profile": metadata.profile, "exif": metadata.exif(), "pnginfo": texts}
    return tags
