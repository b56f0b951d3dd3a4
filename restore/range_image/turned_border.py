"""How much of a sheet's border is turned away from the scanner, where the paper beyond it may not have been seen."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_erosion

from restore.range_image.facets.sheet import Sheet

STEEPEST = np.cos(np.radians(70.0))  # of the line of sight to the paper: a third of the light, a third of the samples


def turned_border(sheet: Sheet) -> float:
    """The share of a sheet's border, 0 to 1, where it is turned by more than 70° from the line of sight."""
    rows, cols = np.nonzero(sheet.inside & ~binary_erosion(sheet.inside))
    sight = sheet.points(np.stack([rows, cols], axis=1).astype(float)) - sheet.rays.origin
    towards = -(sheet.normals()[rows, cols] * sight).sum(axis=1)
    return float((towards < STEEPEST * np.linalg.norm(sight, axis=1)).mean())
