"""Pictures with captions, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import cv2
import font_source_sans_pro as typeface
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from restore.scan import Bytes
from station.pictures.view import BACKGROUND

INK, FAINT_INK = (244, 244, 242), (176, 181, 188)
GAP = 32  # pixels between panels
CAPTION = 84  # pixels below a panel for its two lines
TITLE_SIZE, TEXT_SIZE = 28, 22


class Panel(NamedTuple):
    """A picture (h, w, 3) uint8 RGB with a title and a line of text."""

    picture: Bytes
    title: str
    text: str = ""


def side_by_side(panels: Sequence[Panel]) -> Bytes:
    """Arrange panels in a row with their captions below.

    Pictures may differ in size. Returns (h, w, 3) uint8 RGB.
    """
    height = max(panel.picture.shape[0] for panel in panels)
    width = sum(panel.picture.shape[1] for panel in panels) + GAP * (len(panels) + 1)
    sheet = blank_picture(height + CAPTION + 2 * GAP, width)
    left = GAP
    for panel in panels:
        rows, cols = panel.picture.shape[:2]
        top = GAP + (height - rows) // 2
        sheet[top : top + rows, left : left + cols] = panel.picture
        sheet = draw_text(sheet, panel.title, left, GAP + height + 12, size=TITLE_SIZE)
        sheet = draw_text(sheet, panel.text, left, GAP + height + 48, ink=FAINT_INK)
        left += cols + GAP
    return sheet


def blank_picture(height: int, width: int) -> Bytes:
    """A picture (height, width, 3) uint8 of the background colour."""
    return np.full((height, width, 3), BACKGROUND, np.uint8)


def draw_text(
    picture: Bytes, text: str, left: int, top: int, *, size: int = TEXT_SIZE, ink: tuple[int, int, int] = INK
) -> Bytes:
    """Draw a line of text on a picture.

    Its upper left corner is at the pixel (left, top). Returns (h, w, 3) uint8.
    """
    image = Image.fromarray(picture)
    ImageDraw.Draw(image).text((left, top), text, font=_font(size), fill=ink)
    return np.asarray(image).copy()


def resize_to_fit(picture: Bytes, *, height: int, width: int) -> Bytes:
    """The picture (h, w, 3) scaled, in proportion, to fit into height × width pixels."""
    scale = min(height / picture.shape[0], width / picture.shape[1])
    size = max(1, round(picture.shape[1] * scale)), max(1, round(picture.shape[0] * scale))
    scaled: Bytes = cv2.resize(picture, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC)
    return scaled


@cache
def _font(size: int) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(typeface.SourceSansPro, size)
