"""What a printed page is: its picture, and the truth about it in millimetres.

Page coordinates are millimetres, x right, y up, from the lower left corner of the page.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Protocol

import numpy as np
from pydantic import Field

from drivers.simulated.scene.sheets.sheet import PageSize
from restore.scan import Bytes, Floats

# what an office printer resolves; twice what the longest lens sees at its nearest distance (143 pixels per inch)
DPI = 300
MM_PER_PIXEL = 25.4 / DPI

PAPER = (238, 238, 236)  # sRGB of uncoated office paper: it gives back 0.85 of the light
BLACK = (61, 60, 60)  # carbon toner on it gives back 0.045, at the laser's 690 nm as elsewhere

Gloss = Annotated[float, Field(ge=0, le=1)]
Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class Word:
    """Printed word, its ink's box (left, bottom, right, top) mm, and the size of its type."""

    text: str
    box: Box
    size_pt: float


@dataclass(frozen=True, eq=False)
class Print:
    """A printed page.

    image    (h, w, 3) uint8 RGB (sRGB) at `dpi`; its upper left corner is the page's.
    gloss    0 for matte paper, 1 for coated paper that mirrors the laser.
    markers  id → (4, 2) mm corners: upper left, upper right, lower right, lower left.
    words    in reading order.
    patches  name of an ink → box of a field printed in nothing but it.
    """

    image: Bytes
    page_mm: PageSize
    gloss: float = 0.0
    markers: Mapping[int, Floats] = field(default_factory=dict)
    words: tuple[Word, ...] = ()
    patches: Mapping[str, Box] = field(default_factory=dict)
    dpi: float = DPI


class Artwork(Protocol):
    """Something that can be printed on a page of any size."""

    name: ClassVar[str]

    def print_on(self, page_mm: PageSize) -> Print:
        """The page, printed."""
        ...

    def __hash__(self) -> int:
        """Equal artwork prints equal pages, so they are kept by it."""
        ...


def blank(page_mm: PageSize, dpi: float = DPI) -> Bytes:
    """Return white paper that covers the page, (h, w, 3) uint8 RGB."""
    width, height = (int(np.ceil(side * dpi / 25.4 - 1e-9)) for side in page_mm)
    return np.full((height, width, 3), PAPER, np.uint8)


def box_mm(left: float, top: float, right: float, bottom: float, page_mm: PageSize, dpi: float = DPI) -> Box:
    """Return the box on the page of a box in its picture, given by pixel edges.

    Returns (left, bottom, right, top) mm.
    """
    height, pixel = page_mm[1], 25.4 / dpi
    return left * pixel, height - bottom * pixel, right * pixel, height - top * pixel
