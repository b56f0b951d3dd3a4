"""Where a page may show bare paper, by brightness and hue alone."""

from __future__ import annotations

import cv2
import numpy as np

from restore.numerics.srgb import CLIPPED, LINEAR
from restore.scan import Mask
from restore.shading.channels import as_list, highest, lowest, total_of
from restore.shading.relief import Field
from restore.texture.page import MM_PER_INCH

LIGHT_DPI = 60.0  # cells of 0.42 mm, the samples of the range grid: no shadow is known more exactly
LOCAL_MM = 20.0  # the brightest thing within this distance is paper
PAPER_FRACTION = 0.6  # of that light: darker is ink or picture
HUE = 0.05  # of a channel's fraction of the colour: several lamps or walls of a gutter differ by less, inks by more
SHRINK = 4  # of the cells for the brightest one near each, which varies slowly
SPARED = 7  # every seventh cell suffices for the hue


def paper_candidates(colour: Field, inside: Mask, dpi: float) -> Mask:
    """Return where a page may show bare paper, (r, c).

    It is as bright as its surroundings, of the paper's hue, and not next to ink.
    colour: (r, c, 3), linear, with `dpi` cells to the inch.
    """
    total = total_of(colour)
    brightness = np.where(inside, total, np.float32(0))
    small = brightness[::SHRINK, ::SHRINK]
    reach = 2 * round(LOCAL_MM / MM_PER_INCH * dpi / SHRINK / 2) + 1
    brightest = cv2.dilate(small, np.ones((reach, reach), np.uint8))
    brightest = cv2.resize(brightest, brightness.shape[::-1], interpolation=cv2.INTER_LINEAR)
    bright = inside & (brightness > PAPER_FRACTION * brightest)
    if not bright.any():
        return bright
    some = np.flatnonzero(bright)[::SPARED]
    hue = np.median(as_list(colour)[some] / as_list(total)[some, None], axis=0)
    odd = highest(np.abs(cv2.transform(colour, np.eye(3) - hue[:, None]))) > HUE * total
    dark = (~bright | odd).astype(np.uint8)
    full = lowest(colour) > LINEAR[CLIPPED]
    return np.asarray((cv2.dilate(dark, np.ones((3, 3), np.uint8)) == 0) & ~full)
