"""Segment a table of the paper's colour: by the step in depth from a page that stands clear of it."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numba
import numpy as np
from scipy.ndimage import binary_erosion, binary_fill_holes, distance_transform_edt

from restore.range_image.camera import SHADOW_SLOPE
from restore.scan import Floats, Mask

CLEAR_STEP = 3.0  # 71.6° from page to table: 1.5 mm within a sample; no page bends up as steeply all round it
MAX_CONTACT_MM = 30.0  # a valley of 200 mm radius is within half a millimetre of the table for 28 mm
CONTACT_SLOPE = 1.0  # 45°: a page that touches the table rises from it less steeply, its edge more so
EDGE_BLUR = 3  # samples over which lens and drop-outs blur the edge of the sheet
MAX_GAP = 2  # samples: drop-outs inside ink leave gaps of one or two


class TableByDepth(NamedTuple):
    """A table of which the colour tells nothing.

    samples   (rows, cols) True on it.
    clear     share of the page's outline that stands clear of it.
    touching  share of the page's outline that touches it, where the edge of the page is not seen.
    """

    samples: Mask
    clear: float
    touching: float


def table_by_depth(height: Floats, tolerance: float, pitch: float) -> TableByDepth:
    """The samples on a plane that nothing above it encloses, as a table.

    height (rows, cols) mm of the samples above the plane, NaN for none: those within a tolerance mm may lie on it.
    pitch mm between samples. A strip that touches it between two parts of a page that do not is the page's.
    """
    measured = np.isfinite(height)
    above = measured & (height > tolerance)
    above |= _contacts(height, above, tolerance, pitch)
    above |= _contacts(*(np.ascontiguousarray(grid.T) for grid in (height, above)), tolerance, pitch).T
    solid = cv2.morphologyEx(above.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    inside = binary_fill_holes(cv2.morphologyEx(solid, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)))
    table = np.asarray(measured & (np.abs(height) < tolerance) & ~inside)
    page = _largest(inside)
    outline = page & ~binary_erosion(page, border_value=1) & measured  # at the frame it goes on unseen
    apart = distance_transform_edt(~table)[outline]
    step = height[outline] / (apart * pitch)
    clear = (step > CLEAR_STEP) | ((step > SHADOW_SLOPE) & (apart >= 2.0))
    touching = height[outline] < tolerance + CONTACT_SLOPE * pitch
    return TableByDepth(table, *(float(some.sum() / max(some.size, 1)) for some in (clear, touching)))


def _largest(mask: Mask) -> Mask:
    """The largest connected piece of a mask (rows, cols)."""
    _, labels = cv2.connectedComponents(mask.astype(np.uint8))
    sizes = np.bincount(labels.ravel(), minlength=2)
    return np.asarray(labels == 1 + int(sizes[1:].argmax()))


@numba.njit(cache=True)
def _contacts(height: Floats, above: Mask, tolerance: float, pitch: float) -> Mask:
    """(rows, cols) True in strips of a row, up to MAX_CONTACT_MM wide, from which a surface rises gently to both sides.

    height (rows, cols) mm above the table, NaN for none; tolerance and pitch in mm.
    """
    rows, cols = height.shape
    contact = np.zeros((rows, cols), np.bool_)
    for row in range(rows):
        gently = np.ones((2, cols), np.bool_)
        for past in range(EDGE_BLUR):
            most = tolerance + CONTACT_SLOPE * pitch * (past + MAX_GAP)
            for col in range(cols - past):
                gently[0, col + past] &= not height[row, col] > most  # NaN is no step
                gently[1, col] &= not height[row, col + past] > most
        last = cols
        for col in range(cols):
            if above[row, col]:
                if last < col - 1 and (col - last) * pitch <= MAX_CONTACT_MM and gently[0, last] and gently[1, col]:
                    contact[row, last + 1 : col] = True
                last = col
    return contact
