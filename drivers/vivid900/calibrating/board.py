"""Calibration board: ArUco markers (DICT_4X4_250) at known positions."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from restore.scan import Bytes, Floats, Mask

MM_PER_INCH = 25.4
PAPER = 255
# Of a marker's cell. OpenCV's own 0.3 is a single pixel on a far board, and leaves 0.3 pixels of error there; with 0.8
# it is 0.06.
CORNER_WINDOW = 0.8
CORNER_ACCURACY = 0.005, 60  # pixels, and iterations to come as near; OpenCV stops at 0.1
MAX_MARKERS = 250  # of the dictionary


@dataclass(frozen=True)
class Board:
    """Markers numbered row by row from the upper left.

    The default board fills the view of MIDDLE at 0.9 m.
    marker_mm  side of a marker.
    pitch_mm   from one marker to the next.
    """

    columns: int = 12
    rows: int = 9
    marker_mm: float = 16.002
    pitch_mm: float = 21.505

    def centre(self, marker: int) -> Floats:
        """Return the centre of a marker.

        Returns (2,) mm, x right and y up from the centre of the first.
        """
        row, col = divmod(marker, self.columns)
        return np.array([col, -row]) * self.pitch_mm

    def picture(self, dpi: float) -> Bytes:
        """Draw the board for printing true to scale.

        The margin is as wide as the gap between markers. Returns (h, w) uint8.
        """
        per_mm, gap = dpi / MM_PER_INCH, self.pitch_mm - self.marker_mm
        side = round(self.marker_mm * per_mm)
        height, width = (round((n * self.pitch_mm + gap) * per_mm) for n in (self.rows, self.columns))
        image = np.full((height, width), PAPER, np.uint8)
        for marker in range(self.rows * self.columns):
            left, top = np.rint((self.centre(marker) * [1, -1] + gap) * per_mm).astype(int)
            image[top : top + side, left : left + side] = cv2.aruco.generateImageMarker(_dictionary(), marker, side)
        return image


@dataclass(frozen=True, eq=False)
class DetectedBoard:
    """The detected markers of a board.

    pixels    (n, 2) texture pixels of the markers' centres, where their diagonals cross: blur and detector shift the
              corners of a marker all inwards or all outwards, by 0.15 pixels, which cancels at the centre.
    on_board  (n, 2) mm positions of these on the board.
    corners   (n, 4, 2) texture pixels of the corners.
    """

    pixels: Floats
    on_board: Floats
    corners: Floats

    def area(self, texture_xy: Floats) -> Mask:
        """Return which texture pixels lie inside the outline of the markers.

        texture_xy: (…, 2) pixels. Returns (…) bool.
        """
        outline = cv2.convexHull(self.corners.reshape(-1, 2).astype(np.float32)).reshape(
            -1, 2
        )  # clockwise as it is seen
        inside = np.ones(texture_xy.shape[:-1], bool)
        for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
            along, towards = end - start, texture_xy - start
            inside &= along[0] * towards[..., 1] - along[1] * towards[..., 0] >= 0
        return inside


def detect_board(texture: Bytes, board: Board) -> DetectedBoard | None:
    """Detect the board's markers in a colour image.

    texture: (h, w, 3) uint8. Returns None when fewer than two markers are found.
    """
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    parameters.relativeCornerRefinmentWinSize = CORNER_WINDOW
    parameters.cornerRefinementMinAccuracy, parameters.cornerRefinementMaxIterations = CORNER_ACCURACY
    grey = cv2.cvtColor(texture, cv2.COLOR_RGB2GRAY)
    corners, ids, _ = cv2.aruco.ArucoDetector(_dictionary(), parameters).detectMarkers(grey)
    count = board.rows * board.columns
    found = {int(i): c.reshape(4, 2) for i, c in zip(np.ravel([] if ids is None else ids), corners, strict=True)}
    found = {marker: seen for marker, seen in found.items() if marker < count}
    if len(found) < 2:
        return None
    quads = np.stack(list(found.values())).astype(np.float64)
    return DetectedBoard(_middles(quads), np.stack([board.centre(marker) for marker in found]), quads)


def _middles(corners: Floats) -> Floats:
    """Return where the diagonals of quadrilaterals cross.

    corners: (n, 4, 2). Returns (n, 2).
    """
    a, b, c, d = corners.transpose(1, 0, 2)
    along = _cross(b - a, d - b) / _cross(c - a, d - b)
    return np.asarray(a + along[:, None] * (c - a))


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _dictionary() -> cv2.aruco.Dictionary:
    return cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
