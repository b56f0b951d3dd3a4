"""Coverage of the page as a palette PNG: exact values of `CoverageClass`, in colours."""

from __future__ import annotations

import io

from PIL import Image

# White as paper, the page in two greens, what is missing red, what was inpainted violet, what was covered in a
# photograph yellow: apart for the colour-blind too.
from restore import CoverageClass
from restore.scan import Bytes

COLOURS = {
    CoverageClass.OUTSIDE: (255, 255, 255),
    CoverageClass.MEASURED: (200, 226, 204),
    CoverageClass.INTERPOLATED: (112, 168, 140),
    CoverageClass.OCCLUDED: (192, 48, 40),
    CoverageClass.INPAINTED: (96, 56, 168),
    CoverageClass.OBSTRUCTED: (240, 200, 64),
    CoverageClass.FACING: (176, 176, 176),
    CoverageClass.ERASED: (64, 64, 64),
}


def encode_coverage(seen: Bytes, dpi: float) -> bytes:
    """Encode the coverage (h, w) uint8 as a PNG with a palette.

    Each pixel's index is its value of `CoverageClass`.
    """
    picture = Image.fromarray(seen)
    picture.putpalette([channel for kind in CoverageClass for channel in COLOURS[kind]])
    out = io.BytesIO()
    picture.save(out, "PNG", dpi=(dpi, dpi))
    return out.getvalue()
