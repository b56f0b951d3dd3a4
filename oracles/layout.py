"""The error of a page's layout at every pixel: no marker and no print has a part in it."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import map_coordinates

from drivers.simulated import Truth
from oracles.markers import rigid_residual
from restore import RangeScan, RestoredPage
from restore.scan import Floats
from restore.texture.page import MM_PER_INCH

MAX_PIXELS = 200_000  # of a page are compared


def layout_error(page: RestoredPage, scan: RangeScan, truth: Truth) -> Floats:
    """(k, 2) mm between pixels of the page and the true places on the sheet of what they show."""
    rows, cols = np.nonzero(np.isfinite(page.page_map[..., 0]))
    step = len(rows) // MAX_PIXELS + 1
    rows, cols = rows[::step], cols[::step]
    places = grid_positions(page.page_map[rows, cols], scan)
    true = np.stack([map_coordinates(truth.flat[..., k], places, order=1, cval=np.nan) for k in (0, 1)], axis=1)
    known = np.isfinite(true).all(axis=1)
    found = np.stack([cols, -rows], axis=1) * MM_PER_INCH / page.dpi
    return rigid_residual(found[known], true[known])[0]


def grid_positions(pixels: Floats, scan: RangeScan) -> Floats:
    """Return rows and columns (2, k) of the range grid at pixels (k, 2) x, y of the colour image."""
    first, last = scan.texture_xy[0, 0], scan.texture_xy[-1, -1]
    share = (pixels - first) / (last - first)
    return np.stack([share[:, 1] * (scan.points.shape[0] - 1), share[:, 0] * (scan.points.shape[1] - 1)])
