"""Polygons drawn by hand: their checks."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from restore.errors import BadInput
from restore.scan import Floats

CLIPPED_PX = 20.0  # beyond the image a point is a slip of the hand; farther it is of another image
MIN_AREA_PX2 = 50.0  # less is a click and not an area
HINT = "draw it again"


def checked_polygon(points: Sequence[Sequence[float]] | Floats, size: tuple[int, int], name: str) -> Floats:
    """Return a polygon (n, 2) px within an image of (height, width).

    Points slightly outside are moved to its edge. Raises BadInput for one that lies outside, crosses itself or has no
    area.
    """
    polygon = within_image(np.array(points, float), size, name)
    crossing = _first_crossing(polygon)
    if crossing is not None:
        raise BadInput(f"{name} crosses itself: side {crossing[0]} meets side {crossing[1]}", HINT)
    if cv2.contourArea(polygon.astype(np.float32)) < MIN_AREA_PX2:
        raise BadInput(f"{name} has no area", HINT)
    return polygon


def within_image(points: Floats, size: tuple[int, int], name: str) -> Floats:
    """Move points (n, 2) px to the edge of an image of (height, width).

    Raises BadInput for one far outside.
    """
    last = np.array([size[1] - 1, size[0] - 1], float)
    clipped = np.clip(points, 0.0, last)
    outside = np.abs(points - clipped).max(axis=1)
    if (outside > CLIPPED_PX).any():
        x, y = points[int(np.argmax(outside))]
        raise BadInput(f"{name}: the point ({x:g}, {y:g}) is outside the image of {size[1]} × {size[0]} pixels", HINT)
    return clipped


def _first_crossing(polygon: Floats) -> tuple[int, int] | None:
    """Return the numbers of the first two sides of a polygon (n, 2) that cross, or None."""
    a, b = polygon, np.roll(polygon, -1, axis=0)

    def turn(p: Floats, q: Floats, r: Floats) -> Floats:
        return np.asarray(np.sign((q - p)[..., 0] * (r - p)[..., 1] - (q - p)[..., 1] * (r - p)[..., 0]))

    p, q, r, s = a[:, None], b[:, None], a[None], b[None]
    crosses = (turn(p, q, r) * turn(p, q, s) < 0) & (turn(r, s, p) * turn(r, s, q) < 0)
    first, second = np.nonzero(np.triu(crosses, 1))
    return (int(first[0]), int(second[0])) if len(first) else None
