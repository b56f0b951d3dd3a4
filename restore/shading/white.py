"""White balance on the page's own bare paper.

The colour of the lamp is removed with that of the paper. The lamp multiplies each channel of the camera by its own
factor (von Kries; G. Sharma, "Digital Color Imaging Handbook", 2003, section 5.4), and no picture separates the lamp's
colour from the paper's: afterwards the paper is neutral, whatever its own tint was. Its luminance does not change.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from restore.numerics.limits import SINGLE_TINY
from restore.numerics.srgb import LINEAR, srgb_codes
from restore.report import WhiteReport
from restore.scan import Bytes, Mask
from restore.shading.paper import LIGHT_DPI, paper_candidates
from restore.shading.relief import Field

MIN_PAPER = 0.05  # of the page: text leaves two thirds bare, a picture to the border next to nothing
# Of the channels to green, in linear light: white paper under lamps of 2500 K to 12,000 K (Planckian radiators seen by
# a camera balanced for daylight) has red from 0.83 to 2.7 and blue from 0.18 to 1.6; what lies beyond is a coloured
# ground. A fifth more for the tint of papers.
RED_TO_GREEN, BLUE_TO_GREEN = (0.69, 3.2), (0.15, 1.9)
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear sRGB (IEC 61966-2-1)


@dataclass(frozen=True, eq=False)
class WhiteBalance:
    """A balanced page: image (h, w, 3) uint8, and the report on it (JSON values).

    codes: (256, 1, 3) uint8, what becomes of each code; None where it stays.
    """

    image: Bytes
    report: WhiteReport
    codes: Bytes | None = None

    def balanced(self, image: Bytes, mask: Mask) -> Bytes:
        """Return rows (h, w, 3) of the page at any resolution, balanced where masked."""
        return image if self.codes is None else _recoded(image, mask, self.codes)


def balance_on_paper(image: Bytes, mask: Mask, dpi: float) -> WhiteBalance:
    """Make the bare paper of a page neutral.

    Pixels outside the mask do not change. Where no bare paper is found the image is returned unchanged, and the report
    gives the reason.
    image: (h, w, 3) uint8.
    mask: (h, w).
    """
    colour, inside = _cells(image, mask, dpi)
    paper = paper_candidates(colour, inside, LIGHT_DPI)
    fraction = float(paper.sum() / max(int(inside.sum()), 1))
    if fraction < MIN_PAPER:
        return _unchanged(image, f"bare paper is found on {fraction:.0%} of the page only")
    white = np.median(colour[paper], axis=0).astype(float)
    red, _, blue = white / max(white[1], SINGLE_TINY)
    if not (RED_TO_GREEN[0] < red < RED_TO_GREEN[1] and BLUE_TO_GREEN[0] < blue < BLUE_TO_GREEN[1]):
        return _unchanged(image, "the ground of the page has a colour that no lamp gives white paper")
    gains = float(LUMINANCE @ white) / white
    codes = np.stack([srgb_codes(LINEAR * np.float32(gain)) for gain in gains], axis=-1)[:, None]
    return WhiteBalance(
        _recoded(image, mask, codes),
        {
            "balanced": True,
            "paper": [int(code) for code in srgb_codes(white)],
            "paper_fraction": fraction,
            "gains": [float(gain) for gain in gains],
        },
        codes,
    )


def _recoded(image: Bytes, mask: Mask, codes: Bytes) -> Bytes:
    return np.where(mask[..., None], cv2.LUT(image, codes), image)


def _unchanged(image: Bytes, reason: str) -> WhiteBalance:
    return WhiteBalance(image, {"balanced": False, "reason": reason})


def _cells(image: Bytes, mask: Mask, dpi: float) -> tuple[Field, Mask]:
    """Return linear colour (r, c, 3) of cells at LIGHT_DPI, or of a pixel.

    Returns also which of them are wholly on the page.
    """
    scale = min(1.0, LIGHT_DPI / dpi)
    size = tuple(max(1, round(n * scale)) for n in mask.shape[::-1])
    codes = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    whole = cv2.resize(mask.astype(np.float32), size, interpolation=cv2.INTER_AREA) > 1 - SINGLE_TINY
    return np.asarray(cv2.LUT(codes, LINEAR)), whole
