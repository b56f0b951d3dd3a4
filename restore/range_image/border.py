"""How much of a sheet's border the scanner may have lost.

That is on dark or glossy paper, or where it is turned away. Between a sheet and its table samples are missing where the
sheet keeps the laser off. Such a shadow ends on a ray of the laser, so from the sheet's border to the table beyond it
the depth changes by more than the shadow is wide. A gap that is wider than the step next to it is deep is not a shadow:
the paper there is so dark or glossy that the scanner measured nothing.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_erosion

from restore.camera.rays import STEEP
from restore.numerics.robust import MAJORITY
from restore.range_image.facets.sheet import Sheet
from restore.range_image.gaps import gaps_of_rows
from restore.range_image.segmentation.segment import MAX_LOST, SegmentedScan
from restore.scan import Floats, Mask

STEEPEST = np.cos(np.radians(70.0))  # of the line of sight to the paper: a third of the light, a third of the samples


def lost_border(segmented: SegmentedScan) -> float:
    """Return the fraction of the border lost without a shadow, 0 to 1.

    From there to the table nothing was measured, and no shadow explains it. 0 where the table was not measured.
    """
    depth, measured, inside = -segmented.scan.points[..., 2], segmented.scan.measured, segmented.inside
    beyond = measured[~inside]
    if not beyond.size or beyond.mean() < MAJORITY:  # a table that gives no range says nothing of the paper
        return 0.0
    step = abs(segmented.rays.dx) * STEEP
    shadow = _steep_gaps(depth, measured, step) | _steep_gaps(depth.T, measured.T, step).T
    gaps = _gaps_at_border(measured, inside, shadow) + _gaps_at_border(measured.T, inside.T, shadow.T)
    border = sum(int(np.diff(inside, axis=axis).sum()) for axis in (0, 1))
    return gaps / max(border, 1)


def turned_border(sheet: Sheet) -> float:
    """Return the fraction of a border that is turned away, 0 to 1.

    The sheet is turned by more than 70° from the line of sight there.
    """
    rows, cols = np.nonzero(sheet.inside & ~binary_erosion(sheet.inside))
    sight = sheet.points(np.stack([rows, cols], axis=1).astype(float)) - sheet.rays.origin
    towards = -(sheet.normals()[rows, cols] * sight).sum(axis=1)
    return float((towards < STEEPEST * np.linalg.norm(sight, axis=1)).mean())


def _steep_gaps(depth: Floats, measured: Mask, step: float) -> Mask:
    """Return where depth changes by `step`·depth a sample or more across gaps of a row.

    Returns (rows, cols) bool.
    """
    last, following = gaps_of_rows(measured)
    before, behind = depth.ravel()[last], depth.ravel()[following]
    steep = np.abs(behind - before) >= step * (following - last) * before
    edges = np.zeros(depth.size + 1, np.int8)
    edges[last[steep] + 1], edges[following[steep]] = 1, -1
    return np.cumsum(edges[:-1], dtype=np.int8).reshape(depth.shape).astype(bool)


def _gaps_at_border(measured: Mask, inside: Mask, shadow: Mask) -> int:
    """Count the gaps of a row that lead from the sheet to what lies beyond.

    They are wider than those that the sheet goes on over, and not in a shadow.
    """
    last, following = gaps_of_rows(measured)
    leads = (following - last > MAX_LOST) & (inside.ravel()[last] != inside.ravel()[following])
    shadowed = np.cumsum(shadow)  # samples, up to each
    return int((shadowed[last[leads]] == shadowed[following[leads] - 1]).sum())
