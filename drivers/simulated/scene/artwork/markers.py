"""Pages to measure by: white paper, and a field of fiducial markers."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from drivers.simulated.scene.artwork.printed import BLACK, MM_PER_PIXEL, PAPER, Gloss, Print, blank
from drivers.simulated.scene.sheets.sheet import PageSize, parameters
from restore.scan import Floats


@parameters
class White:
    """Nothing printed."""

    name: ClassVar[str] = "white"
    gloss: Gloss = 0.0

    def print_on(self, page_mm: PageSize) -> Print:
        """White paper."""
        return Print(blank(page_mm), page_mm, gloss=self.gloss)


@parameters
class Markers:
    """Page full of ArUco markers (DICT_4X4_250), numbered row by row from the upper left.

    By default, 189 pixels for a marker, 254 from one to the next and 94 of margin print as 16.002, 21.505 and 7.959 mm.
    """

    name: ClassVar[str] = "markers"
    marker_px: Annotated[int, Field(ge=30, le=2000)] = 189
    pitch_px: Annotated[int, Field(ge=36, le=4000)] = 254
    margin_px: Annotated[int, Field(ge=0, le=2000)] = 94
    gloss: Gloss = 0.0

    def print_on(self, page_mm: PageSize) -> Print:
        """As many markers as fit, up to the 250 of the dictionary."""
        import cv2

        image = blank(page_mm)
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
        rows, cols = (max((side - self.margin_px - self.marker_px) // self.pitch_px + 1, 0) for side in image.shape[:2])
        markers = {}
        for i in range(min(rows * cols, len(dictionary.bytesList))):
            top, left = (self.margin_px + k * self.pitch_px for k in divmod(i, cols))
            bits = cv2.aruco.generateImageMarker(dictionary, i, self.marker_px)
            image[top : top + self.marker_px, left : left + self.marker_px] = np.where(
                bits[..., None] > 0, PAPER, BLACK
            )
            markers[i] = self._corners(left, top, page_mm)
        return Print(image, page_mm, gloss=self.gloss, markers=markers)

    def _corners(self, left: int, top: int, page_mm: PageSize) -> Floats:
        square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * self.marker_px + np.array([left, top])
        return np.array([0.0, page_mm[1]]) + square * MM_PER_PIXEL * np.array([1.0, -1.0])
