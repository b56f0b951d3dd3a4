"""A copperplate engraving, as of a map: hills in contour lines, and their names."""

from __future__ import annotations

from typing import Annotated, ClassVar

import cv2
import numpy as np
from PIL import Image
from pydantic import Field

from drivers.simulated.scene.artwork.printed import BLACK, MM_PER_PIXEL, Print, Word, blank
from drivers.simulated.scene.artwork.typeset import Column
from drivers.simulated.scene.sheets.sheet import PageSize, parameters
from restore.scan import Bytes, Floats

NAMES = ("Alder Fell", "Beacon Hill", "Carrow Edge", "Dun Moor", "Eastlow", "Fallow Down", "Gorse Top", "Hartside")
NAMES_PT = 14.0
HILLS, LEVELS = 14, 9  # of the landscape; contour lines of its height
WIDEST, NARROWEST = 0.25, 0.09  # standard deviation of a hill, fractions of the page's height
LINE_PX, FRAME_PX = 3, 8  # of 300 dpi: a fine line of a plate is a quarter of a millimetre
NAME_MM = 40.0  # room for a name


@parameters
class Engraving:
    """Contour lines from edge to edge of a frame, with names; without dark areas.

    margin_mm  from the edge of the page to the frame.
    seed       of the hills and of the places of their names.
    """

    name: ClassVar[str] = "engraving"
    margin_mm: Annotated[float, Field(ge=2, le=60)] = 9.0
    seed: Annotated[int, Field(ge=0)] = 0

    def print_on(self, page_mm: PageSize) -> Print:
        """The words are the names, in the order in which they were engraved."""
        random = np.random.default_rng(self.seed)
        image = blank(page_mm).copy()
        height, width = image.shape[:2]
        edge = round(self.margin_mm / MM_PER_PIXEL)
        inside = np.s_[edge : height - edge, edge : width - edge]
        field = _hills(random, height, width)[inside]
        for level in np.linspace(field.min(), field.max(), LEVELS + 2)[1:-1]:
            lines, _ = cv2.findContours((field > level).astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
            image[inside] = cv2.drawContours(np.ascontiguousarray(image[inside]), lines, -1, BLACK, LINE_PX)
        cv2.rectangle(image, (edge, edge), (width - edge, height - edge), BLACK, FRAME_PX)
        return self._named(image, page_mm, random)

    def _named(self, image: Bytes, page_mm: PageSize, random: np.random.Generator) -> Print:
        picture, words = Image.fromarray(image), list[Word]()
        room = np.array(page_mm) - 2 * self.margin_mm
        for name, place in zip(NAMES, random.uniform([0.05, 0.05], [0.7, 0.9], (len(NAMES), 2)), strict=True):
            left, top = (self.margin_mm + place * room) / MM_PER_PIXEL
            column = Column(picture, page_mm, left, left + NAME_MM / MM_PER_PIXEL, top, image.shape[0])
            words += column.set(name, NAMES_PT, "serif")
        return Print(np.asarray(picture), page_mm, words=tuple(words))


def _hills(random: np.random.Generator, height: int, width: int) -> Floats:
    """Return the heights (height, width) of a landscape of round hills."""
    y, x = np.mgrid[:height, :width].astype(np.float32) / height
    ground = np.zeros((height, width), np.float32)
    for _ in range(HILLS):
        across, down, spread, rise = random.uniform([0, 0, NARROWEST, 0.4], [width / height, 1, WIDEST, 1])
        away = (x - np.float32(across)) ** 2 + (y - np.float32(down)) ** 2
        ground += np.float32(rise) * np.exp(-away / np.float32(2 * spread**2))
    return np.asarray(ground, float)
