"""Places within polygons."""

from __future__ import annotations

import numba
import numpy as np

from restore.scan import Floats, Mask


def inside_polygon(places: Floats, corners: Floats) -> Mask:
    """Return which places (…, 2) are within a polygon, (…) bool.

    Rays cross it an odd number of times.
    corners: (m, 2).
    """
    inside = _crosses_odd(np.asarray(places, np.float64).reshape(-1, 2), np.ascontiguousarray(corners, np.float64))
    return np.asarray(inside.reshape(places.shape[:-1]))


@numba.njit(cache=True)
def _crosses_odd(places: Floats, corners: Floats) -> Mask:
    inside = np.zeros(len(places), np.bool_)
    for i in range(len(places)):
        x, y = places[i]
        for k in range(len(corners)):
            ax, ay = corners[k - 1]
            bx, by = corners[k]
            if (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / (by - ay):
                inside[i] = not inside[i]
    return inside
