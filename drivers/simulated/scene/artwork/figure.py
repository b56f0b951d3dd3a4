"""A page with a colour picture, a line drawing and fields of the printing inks."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from PIL import Image, ImageDraw
from pydantic import Field

from drivers.simulated.scene.artwork.printed import BLACK, MM_PER_PIXEL, Box, Gloss, Print, Word, blank, box_mm
from drivers.simulated.scene.artwork.typeset import Column
from drivers.simulated.scene.sheets.sheet import PageSize, parameters
from restore.scan import Bytes, Floats

# sRGB of solid fields of office toners. Their red channel stands for what they give back at the laser's 690 nm:
# cyan, and with it blue and green, absorb there; magenta and yellow let it through.
INKS = {
    "black": BLACK,
    "cyan": (64, 160, 214),
    "magenta": (205, 60, 130),
    "yellow": (240, 222, 60),
    "red": (208, 66, 56),
    "green": (58, 140, 82),
    "blue": (60, 72, 150),
    "grey": (128, 128, 128),
}
RINGS = 9  # circles of the drawing
COARSE = 3  # the landscape is painted at 100 dpi, as pictures on the web are


@parameters
class Figure:
    """Ink fields along the top, a picture, circles, and captions.

    The colour picture is on the left, the circles on the right.
    """

    name: ClassVar[str] = "figure"
    caption_pt: Annotated[float, Field(ge=6, le=36)] = 14.0
    gloss: Gloss = 0.0

    def print_on(self, page_mm: PageSize) -> Print:
        """Print the figure; positions are fractions of the page.

        Fields from 0.05 to 0.25 of its height, figures to 0.82, captions below.
        """
        image = blank(page_mm).copy()
        size = np.asarray(page_mm) / MM_PER_PIXEL
        patches = {
            ink: _field(image, INKS[ink], _pixels(size, 0.04 + i * 0.116, 0.05, 0.106, 0.20), page_mm)
            for i, ink in enumerate(INKS)
        }
        left, top, right, bottom = _pixels(size, 0.04, 0.30, 0.52, 0.52)
        picture = Image.fromarray(image)
        scene = Image.fromarray(landscape((bottom - top) // COARSE, (right - left) // COARSE))
        picture.paste(scene.resize((right - left, bottom - top), Image.Resampling.BICUBIC), (left, top))
        _rings(ImageDraw.Draw(picture), _pixels(size, 0.60, 0.30, 0.36, 0.52))
        captions = [(0.04, 0.56, "Figure 1. Evening over the hills."), (0.60, 0.96, "Figure 2. Rings.")]
        words: list[Word] = []
        for start, end, text in captions:
            column = Column(picture, page_mm, start * size[0], end * size[0], 0.84 * size[1], size[1])
            words += column.set(text, self.caption_pt, "sans")
        return Print(np.asarray(picture), page_mm, gloss=self.gloss, words=tuple(words), patches=patches)


def landscape(height: int, width: int) -> Bytes:
    """Draw a landscape with sky, sun and three ranges of hills, (height, width, 3) uint8 RGB."""
    y, x = (np.mgrid[:height, :width] + 0.5) / np.array([height, width]).reshape(2, 1, 1)
    picture = _mix(np.array([70.0, 110, 190]), np.array([250.0, 170, 90]), y / 0.7)
    picture = _mix(picture, np.array([255.0, 244, 200]), 9 - np.hypot((x - 0.68) * width / height, y - 0.42) * 100)
    for base, swing, waves, colour in (
        (0.55, 0.06, 5, (150, 90, 110)),
        (0.68, 0.05, 8, (96, 70, 90)),
        (0.82, 0.04, 13, (40, 60, 52)),
    ):
        ridge = base + swing * np.sin(waves * x + base * 20) + swing / 3 * np.sin(2.7 * waves * x)
        picture = _mix(picture, np.array(colour, float), (y - ridge) * height)
    return np.clip(picture, 0, 255).astype(np.uint8)


def _mix(under: Floats, over: Floats, fraction: Floats) -> Floats:
    fraction = np.clip(fraction, 0, 1)[..., None]
    return np.asarray(under * (1 - fraction) + over * fraction)


def _pixels(size: Floats, left: float, top: float, width: float, height: float) -> tuple[int, int, int, int]:
    edges = np.rint(np.array([left, top, left + width, top + height]) * np.tile(size, 2)).astype(int)
    return int(edges[0]), int(edges[1]), int(edges[2]), int(edges[3])


def _field(image: Bytes, ink: tuple[int, int, int], pixels: tuple[int, int, int, int], page_mm: PageSize) -> Box:
    left, top, right, bottom = pixels
    image[top:bottom, left:right] = ink
    return box_mm(left, top, right, bottom, page_mm)


def _rings(pen: ImageDraw.ImageDraw, pixels: tuple[int, int, int, int]) -> None:
    left, top, right, bottom = pixels
    pen.rectangle(pixels, outline=BLACK, width=6)
    for i in range(1, RINGS):
        reach = np.array([right - left, bottom - top]).min() / 2 * i / RINGS
        x, y = (left + right) / 2, (top + bottom) / 2
        pen.ellipse(
            (x - reach, y - reach, x + reach, y + reach), outline=INKS["blue"] if i % 2 else INKS["red"], width=8
        )
