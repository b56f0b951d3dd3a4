"""The prints of two facing pages, and the leather of a cover."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal

import cv2
import numpy as np
from PIL import Image
from pydantic import Field

from drivers.simulated.scene.artwork.figure import Figure
from drivers.simulated.scene.artwork.markers import White
from drivers.simulated.scene.artwork.printed import MM_PER_PIXEL, Artwork, Print, Word, blank
from drivers.simulated.scene.artwork.text import Text
from drivers.simulated.scene.artwork.typeset import Column
from drivers.simulated.scene.sheets.sheet import PageSize, parameters
from restore.scan import Bytes

Kind = Literal["text", "white", "figure"]
LEATHER = (128, 84, 52)  # sRGB of brown calf
GILT = (226, 190, 110)  # of gold leaf that does not mirror the lamp
GILT_MM = 1.2  # width of its line
GRAIN = 9.0  # grey levels: standard deviation of its grain
FOLIO_PT, FOLIO_MM = 11.0, 4.0  # of the numbers in the margin: size of type, half the width of their column
GRAIN_PX = 2.0  # of the grain, a sixth of a millimetre


@parameters
class Facing:
    """Two pages side by side, each printed for itself within its margins.

    left, right  what is printed on each: `text`, `figure` or `white`.
    left_mm      width of the left page.
    folios       numbers of both pages, in their lower margins; empty for a page without.
    seed         of the texts, which differ left and right.
    """

    name: ClassVar[str] = "facing"
    left: Kind = "text"
    right: Kind = "text"
    left_mm: Annotated[float, Field(gt=0)] = 130.0
    margin_mm: Annotated[float, Field(ge=0, le=60)] = 12.0
    columns: Annotated[int, Field(ge=1, le=2)] = 1
    folios: tuple[str, str] = ("", "")
    seed: Annotated[int, Field(ge=0)] = 0

    def print_on(self, page_mm: PageSize) -> Print:
        """The words of both pages in reading order, their places on the sheet."""
        width, height = page_mm
        left = self._artwork(self.left, 2 * self.seed).print_on((self.left_mm, height))
        right = self._artwork(self.right, 2 * self.seed + 1).print_on((width - self.left_mm, height))
        image = blank(page_mm)
        split = round(image.shape[1] * self.left_mm / width)
        for part, cols in ((left, slice(0, split)), (right, slice(split, None))):
            rows, across = image[:, cols].shape[:2]
            image[:, cols] = cv2.resize(part.image, (across, rows), interpolation=cv2.INTER_AREA)
        image, numbers = self._numbered(image, page_mm)
        words = (*left.words, *(_moved(word, self.left_mm) for word in right.words), *numbers)
        return Print(image, page_mm, words=words)

    def _numbered(self, image: Bytes, page_mm: PageSize) -> tuple[Bytes, list[Word]]:
        """The picture with both numbers in the middle of the lower margins, and their places."""
        width, height = page_mm
        picture = Image.fromarray(image)
        words: list[Word] = []
        for folio, middle_mm in zip(self.folios, (self.left_mm / 2, (self.left_mm + width) / 2), strict=True):
            left, top = ((at / MM_PER_PIXEL) for at in (middle_mm - FOLIO_MM, height - self.margin_mm))
            column = Column(picture, page_mm, left, left + 2 * FOLIO_MM / MM_PER_PIXEL, top, image.shape[0])
            words += column.set(folio, FOLIO_PT, "serif")
        return np.asarray(picture), words

    def _artwork(self, kind: Kind, seed: int) -> Artwork:
        style: dict[str, Any] = {"title_pt": 18.0, "sizes_pt": (12.0, 10.0), "columns": self.columns}
        style |= {"seed": seed, "margin_mm": self.margin_mm}
        kinds: dict[Kind, Artwork] = {
            "text": Text(**style),
            "white": White(),
            "figure": Figure(),
        }
        return kinds[kind]


def _moved(word: Word, right_mm: float) -> Word:
    left, bottom, right, top = word.box
    return replace(word, box=(left + right_mm, bottom, right + right_mm, top))


@parameters
class Leather:
    """The board of a book in brown leather, with its grain and a gilt frame.

    frame_mm  from the edge of the board to the frame.
    """

    name: ClassVar[str] = "leather"
    frame_mm: Annotated[float, Field(ge=2, le=60)] = 16.0
    seed: Annotated[int, Field(ge=0)] = 0

    def print_on(self, page_mm: PageSize) -> Print:
        """Grain of one size all over, and the frame."""
        image = blank(page_mm)
        noise = np.random.default_rng(self.seed).standard_normal(image.shape[:2])
        grain = cv2.GaussianBlur(noise, (0, 0), GRAIN_PX)
        grain *= GRAIN / grain.std()
        board = np.clip(np.array(LEATHER) + grain[..., None], 0, 255).astype(np.uint8)
        edge = round(self.frame_mm / MM_PER_PIXEL)
        corner = (board.shape[1] - edge, board.shape[0] - edge)
        cv2.rectangle(board, (edge, edge), corner, GILT, round(GILT_MM / MM_PER_PIXEL))
        return Print(board, page_mm)
