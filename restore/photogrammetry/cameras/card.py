"""The scale card: a printed strip of ArUco markers (DICT_5X5_50).

It gives photographs their scale.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from restore.scan import Bytes, Floats, Mask

MM_PER_INCH = 25.4
PAPER, INK = 255, 0
CELLS = 7  # to a marker's side: five of its code and a border on either side
# Of a marker's cell. The corners only serve to cross the diagonals, and a wider window averages more of their noise.
CORNER_WINDOW = 0.6
CORNER_ACCURACY = 0.01, 50  # pixels, and iterations to come as near
DETECTION_SIDE = 2000  # pixels: markers are searched for in a copy of at most this, and refined in the photograph


@dataclass(frozen=True)
class ScaleCard:
    """Markers numbered row by row from the upper left, on a strip of paper.

    marker_mm  side of a marker.
    pitch_mm   from one marker to the next.
    margin_mm  of paper beyond the markers.

    >>> ScaleCard().size_mm
    (172.0, 60.0)
    """

    columns: int = 6
    rows: int = 2
    marker_mm: float = 20.0
    pitch_mm: float = 28.0
    margin_mm: float = 6.0

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height of the strip."""
        width, height = (
            (n - 1) * self.pitch_mm + self.marker_mm + 2 * self.margin_mm for n in (self.columns, self.rows)
        )
        return width, height

    @property
    def centres(self) -> Floats:
        """Return the centres of the markers, (n, 2) mm.

        x right and y up from the centre of the card.
        """
        row, col = np.divmod(np.arange(self.columns * self.rows), self.columns)
        return np.stack([col - (self.columns - 1) / 2, (self.rows - 1) / 2 - row], axis=1) * self.pitch_mm

    def ink(self, marker: int) -> Mask:
        """Return the black cells of a marker, (7, 7), row 0 at the top."""
        return np.asarray(cv2.aruco.generateImageMarker(_dictionary(), marker, CELLS) == INK)

    def picture(self, dpi: float) -> Bytes:
        """Return the card as it is printed, (h, w) uint8."""
        per_mm = dpi / MM_PER_INCH
        size = np.array(self.size_mm)
        image = np.full(np.rint(size[::-1] * per_mm).astype(int), PAPER, np.uint8)
        side = round(self.marker_mm * per_mm)
        for marker, centre in enumerate(self.centres):
            left, top = np.rint((size / 2 + centre * [1, -1] - self.marker_mm / 2) * per_mm).astype(int)
            image[top : top + side, left : left + side] = cv2.aruco.generateImageMarker(_dictionary(), marker, side)
        return image

    @property
    def outline(self) -> Floats:
        """Return the corners (4, 2) of the strip, mm from its centre, counter-clockwise."""
        return np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.array(self.size_mm) / 2

    def hull(self, markers: Sequence[int], margin_mm: float | None = None) -> Floats:
        """Return the convex hull of some markers with a margin, (n, 2) mm.

        Counter-clockwise; by default of all markers.
        """
        reach = self.marker_mm / 2 + (self.margin_mm if margin_mm is None else margin_mm)
        corners = self.centres[list(markers), None] + reach * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        hull = cv2.convexHull(corners.reshape(-1, 1, 2).astype(np.float32)).reshape(-1, 2)
        return np.asarray(hull, np.float64)


SCALE_CARD = ScaleCard()
"""The card that `planish card` prints, the default."""


def detect_markers(image: Bytes, card: ScaleCard = SCALE_CARD) -> Mapping[int, Floats]:
    """Return the pixel (2,) of the centre of every marker of a card, by its number.

    A centre is where the diagonals cross: blur and the detector shift the corners of a marker all inwards or all
    outwards, which cancels there. A marker that is seen twice is left out: there are two cards.
    image: (h, w, 3) uint8 RGB.
    """
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    ratio = min(1.0, DETECTION_SIDE / max(grey.shape))
    small = cv2.resize(grey, None, fx=ratio, fy=ratio, interpolation=cv2.INTER_AREA) if ratio < 1.0 else grey
    quads, ids, _ = cv2.aruco.ArucoDetector(_dictionary(), cv2.aruco.DetectorParameters()).detectMarkers(small)
    numbers = [int(number) for number in np.ravel([] if ids is None else ids)]
    scale = np.array(grey.shape[::-1]) / small.shape[::-1]
    found = {}
    for number, quad in zip(numbers, quads, strict=True):
        if number < card.columns * card.rows and numbers.count(number) == 1:
            corners = (quad.reshape(4, 2).astype(np.float64) + 0.5) * scale - 0.5
            found[number] = crossing_of_diagonals(_refined(grey, corners))
    return found


def outline_in(
    seen: Mapping[int, Floats], card: ScaleCard = SCALE_CARD, *, margin_mm: float | None = None
) -> Floats | None:
    """Return the hull of a card's markers in a photograph, pixels (n, 2).

    The page may hide the rest of the card.
    seen: pixels (2,) by the number of the marker.
    margin_mm: that of the card when None.
    Returns None for fewer than four markers.
    """
    numbers = list(seen)
    if len(numbers) < 4:
        return None
    plane, _ = cv2.findHomography(card.centres[numbers], np.array([seen[number] for number in numbers]))
    return (
        None if plane is None else np.asarray(cv2.perspectiveTransform(card.hull(numbers, margin_mm)[None], plane)[0])
    )


def _refined(grey: Bytes, corners: Floats) -> Floats:
    """Refine the corners (4, 2) of a marker in grey (h, w) to a fraction of a pixel."""
    cell = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).min() / CELLS
    reach = max(int(cell * CORNER_WINDOW), 2)
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, CORNER_ACCURACY[1], CORNER_ACCURACY[0])
    given = np.ascontiguousarray(corners[:, None], np.float32)
    return np.asarray(cv2.cornerSubPix(grey, given, (reach, reach), (-1, -1), criteria)[:, 0], np.float64)


def crossing_of_diagonals(corners: Floats) -> Floats:
    """Return where the diagonals of a quadrilateral (4, 2) cross, (2,)."""
    a, b, c, d = corners
    matrix = np.stack([c - a, b - d], axis=1)
    return np.asarray(a + np.linalg.solve(matrix, b - a)[0] * (c - a))


def _dictionary() -> cv2.aruco.Dictionary:
    return cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50)
