"""Segments a table of the paper's colour, by its depth below the page.

The page stands clear of it.
"""

from __future__ import annotations

import numba
import numpy as np

from restore.camera.rays import EDGE_BLUR, MAX_GAP, STEEP
from restore.range_image.segmentation.outline import is_sheet, without_speckles
from restore.range_image.segmentation.plane import TablePlane, lies_on
from restore.scan import Floats, Mask

MAX_CONTACT_MM = 30.0  # a valley of 200 mm radius is within half a millimetre of the table for 28 mm


def table_by_depth(plane: TablePlane) -> Mask | None:
    """Return the samples on a plane that nothing above it encloses.

    A strip that touches it between two parts of a page that do not is the page's. Returns (rows, cols) bool; None when
    the rest is not a sheet above it.
    """
    height, tolerance, pitch = plane
    above = height > tolerance  # NaN is not
    above |= _contacts(height, above, tolerance, pitch)
    above |= _contacts(*(np.ascontiguousarray(grid.T) for grid in (height, above)), tolerance, pitch).T
    sheet = plane.measured & without_speckles(above)
    return None if lies_on(plane, sheet) or not is_sheet(sheet, plane.measured) else plane.samples & ~sheet


@numba.njit(cache=True)
def _contacts(height: Floats, above: Mask, tolerance: float, pitch: float) -> Mask:
    """Return narrow strips of a row where a surface touches the table.

    Up to MAX_CONTACT_MM wide; from them a surface rises gently to both sides.
    height: (rows, cols) mm above the table, NaN where missing.
    tolerance, pitch: mm.
    """
    rows, cols = height.shape
    contact = np.zeros((rows, cols), np.bool_)
    for row in range(rows):
        gently = np.ones((2, cols), np.bool_)
        for past in range(EDGE_BLUR):
            most = tolerance + STEEP * pitch * (past + MAX_GAP)
            for col in range(cols - past):
                gently[0, col + past] &= not height[row, col] > most  # NaN is not a step
                gently[1, col] &= not height[row, col + past] > most
        last = cols
        for col in range(cols):
            if above[row, col]:
                if last < col - 1 and (col - last) * pitch <= MAX_CONTACT_MM and gently[0, last] and gently[1, col]:
                    contact[row, last + 1 : col] = True
                last = col
    return contact
