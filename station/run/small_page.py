"""A small page, by which the kernels are compiled and a process gets ready."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from restore import RangeScan

ROWS, COLS = 40, 56  # enough for every step
PITCH = 1 / 485.0  # of the lines of sight, one millimetre deep: every fourth pixel of the MIDDLE lens
RADIUS_MM, DISTANCE_MM = 200.0, 900.0


def small_page() -> RangeScan:
    """Return a scan of (ROWS, COLS) samples of a small page of noise.

    It is curled round an upright cylinder.
    """
    import numpy as np

    from restore import RangeScan

    rows, cols = np.indices((ROWS, COLS)).astype(float)
    x, y = (cols - (COLS - 1) / 2) * PITCH, ((ROWS - 1) / 2 - rows) * PITCH
    # Where a line of sight (x, y, −1)·depth meets the cylinder: (depth·x)² + (depth − axis)² = radius².
    axis = DISTANCE_MM + RADIUS_MM
    depth = (axis - np.sqrt(axis**2 - (1 + x**2) * (axis**2 - RADIUS_MM**2))) / (1 + x**2)
    points = np.dstack([x * depth, y * depth, -depth])
    texture = np.random.default_rng(1).integers(0, 256, (ROWS, COLS, 3), np.uint8)
    return RangeScan(points, texture, np.dstack([cols, rows]), {})


def get_ready() -> None:
    """Load what a restoration needs, by one of a small page.

    What fails here is reported by the first page.
    """
    with suppress(Exception):
        from restore import restore

        restore(small_page())
