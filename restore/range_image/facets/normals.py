"""Unit normals of the facets of a sheet."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from restore.numerics.limits import SINGLE_TINY
from restore.numerics.robust import MAJORITY, NEARLY_ALL
from restore.range_image.facets.facet_model import WIDE_RADIUS
from restore.range_image.facets.sheet import Sheet
from restore.scan import Mask

DENSE_OVER = 2 * WIDE_RADIUS + 1  # samples: what a facet is fitted to
SMOOTHING = 8.0  # samples, 4 mm: how far the slopes round it are asked then
SHRINK = 4  # of the grid for that

Field = NDArray[np.float32]


def facet_normals(sheet: Sheet) -> Field:
    """Return the unit normals of the facets towards the scanner.

    Where hardly anything was measured, in ink that absorbs the laser, a facet's own slope is noise: the facets round it
    are used there. Returns (rows, cols, 3).
    """
    return _smoothed_where_sparse(sheet.normals(), sheet.measured)


def _smoothed_where_sparse(normals: Field, measured: Mask) -> Field:
    density = cv2.boxFilter(measured.astype(np.float32), -1, (DENSE_OVER, DENSE_OVER))
    # Where most were lost, the rest is too few for a slope of its own.
    own = np.clip((density - MAJORITY) / (NEARLY_ALL - MAJORITY), 0.0, 1.0)
    trust = np.maximum(own, np.float32(SINGLE_TINY))
    # Over that many samples every fourth is enough.
    size = tuple(-(-n // SHRINK) for n in density.shape[::-1])
    total, weight = (
        cv2.GaussianBlur(cv2.resize(field, size, interpolation=cv2.INTER_AREA), (0, 0), SMOOTHING / SHRINK)
        for field in (normals * trust[..., None], trust)
    )
    round_it = cv2.resize(total / weight[..., None], density.shape[::-1], interpolation=cv2.INTER_LINEAR)
    mixed = cv2.blendLinear(normals, round_it, own, 1 - own)
    length = np.sqrt(cv2.transform(mixed * mixed, np.ones((1, 3))))
    return np.asarray(mixed / length[..., None])
