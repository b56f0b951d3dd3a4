"""Coverage of the page as a palette PNG: exact values of `Seen`, one colour for each."""

from __future__ import annotations

import io

from PIL import Image

# White as paper, the page in two greens, what is missing red, what was invented violet, what was covered in a
# photograph yellow: apart for the colour-blind too.
from restore import Seen
from restore.scan import Bytes

COLOURS = {
    Seen.OUTSIDE: (255, 255, 255),
    Seen.MEASURED: (200, 226, 204),
    Seen.FILLED: (112, 168, 140),
    Seen.HIDDEN: (192, 48, 40),
    Seen.INVENTED: (96, 56, 168),
    Seen.COVERED: (240, 200, 64),
    Seen.FACING: (176, 176, 176),
    Seen.REMOVED: (64, 64, 64),
}


def encode_coverage(seen: Bytes, dpi: float) -> bytes:
    """The coverage (h, w) uint8 as a PNG with a palette: each pixel's index is its value of `Seen`."""
    picture = Image.fromarray(seen)
    picture.putpalette([channel for kind in Seen for channel in COLOURS[kind]])
    out = io.BytesIO()
    picture.save(out, "PNG", dpi=(dpi, dpi))
    return out.getvalue()
