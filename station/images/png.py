"""PNG with resolution (chunk pHYs), colour profile (iCCP) and metadata (eXIf, iTXt)."""

from __future__ import annotations

from typing import Any

from PIL.PngImagePlugin import PngInfo

from restore import formats
from restore.scan import Bytes
from station.images.image_metadata import ImageMetadata


def encode_png(image: Bytes, dpi: float | None = None, metadata: ImageMetadata | None = None) -> bytes:
    """Encode a picture (h, w, 3) uint8 RGB as a PNG file.

    With `dpi`, one inch of paper is `dpi` pixels. pHYs counts whole pixels a metre, so the tag is within 0.5 / 5906 of
    150 dpi (PNG specification, 11.3.4.3).
    """
    tags: dict[str, Any] = {} if dpi is None else {"dpi": (dpi, dpi)}
    if metadata is not None:
        texts = PngInfo()
        texts.add_itxt("XML:com.adobe.xmp", metadata.xmp().decode("utf-8"))
        tags |= {"icc_profile": metadata.profile, "exif": metadata.exif(), "pnginfo": texts}
    return formats.encode_png(image, **tags)
