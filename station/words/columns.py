"""Gutters between columns of text, and rules drawn in them.

They are for a reader that would read across. Tesseract joins the lines of two columns on some pages and not on others
that differ by their noise alone. It always sees a vertical rule as the end of a column.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from restore.scan import Bytes

X_HEIGHT = 4  # pixels of the small letters in the copy in which gutters are sought: words are still apart there
INKED = 0.1  # fraction of a pixel of that copy that makes it ink
MIN_WIDTH = 1.5  # x-heights: between two words of a line is half one, between columns two and more
MIN_LENGTH = 0.5  # of the height of all text: shorter gaps are of chance, or next to a picture or a short last line
SIDE_REACH = 15.0  # x-heights on either side in which text must stand
MIN_LINES = 0.4  # of the rows of a gutter, on either side, have ink: lines of text have it on 0.6 to 0.9
RULE_INCHES = 0.01  # as wide as a printed rule


@dataclass(frozen=True)
class Gutter:
    """A white strip between columns: the middle x, top and bottom, pixels of the page."""

    x: float
    top: float
    bottom: float


def find_gutters(ink: Bytes, x_height_px: float) -> list[Gutter]:
    """Find the gutters between columns of text.

    ink: (h, w), above 0 on text.
    x_height_px: height of its small letters.
    """
    scale = X_HEIGHT / x_height_px
    area = cv2.resize((ink > 0).astype(np.float32), None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    small = area > INKED
    rows = np.flatnonzero(small.any(axis=1))
    if not len(rows):
        return []
    top, bottom = int(rows[0]), int(rows[-1]) + 1
    white = (~small[top:bottom]).view(np.uint8)
    wide = np.ones((1, round(MIN_WIDTH * X_HEIGHT)), np.uint8)
    long = np.ones((max(round(MIN_LENGTH * (bottom - top)), 1), 1), np.uint8)
    # Beyond the border nothing counts as white: a strip that ends there would pass with half of its length.
    beyond = {"borderType": cv2.BORDER_CONSTANT, "borderValue": 0}
    strips = cv2.morphologyEx(cv2.morphologyEx(white, cv2.MORPH_OPEN, wide, **beyond), cv2.MORPH_OPEN, long, **beyond)
    _, _, boxes, _ = cv2.connectedComponentsWithStats(strips, connectivity=4)
    return [
        Gutter((left + width / 2) / scale, (top + upper) / scale, (top + upper + height) / scale)
        for left, upper, width, height, _ in boxes[1:].tolist()
        if _between_columns(small[top + upper : top + upper + height], left, left + width)
    ]


def _between_columns(ink: np.ndarray, left: int, right: int) -> bool:
    """Return whether a strip is between columns of text.

    Most rows of ink (h, w) have some on both sides of it.
    """
    reach = round(SIDE_REACH * X_HEIGHT)
    sides = ink[:, max(left - reach, 0) : left], ink[:, right : right + reach]
    return all(side.any(axis=1).mean() > MIN_LINES for side in sides)


def with_rules(image: Bytes, gutters: list[Gutter], dpi: float) -> Bytes:
    """Return a copy of a page with a black rule down each gutter.

    image: (h, w, 3) uint8, with `dpi` pixels to the inch.
    """
    ruled = image.copy()
    for gutter in gutters:
        x, top, bottom = (round(value) for value in (gutter.x, gutter.top, gutter.bottom))
        cv2.line(ruled, (x, top), (x, bottom), (0, 0, 0), max(1, round(RULE_INCHES * dpi)))
    return ruled
