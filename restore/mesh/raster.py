"""Rasterise triangles: values given at the corners, interpolated at every pixel centre, with or without a z-buffer."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from restore.scan import Floats, Ints

EDGE_TOLERANCE = 1e-6  # of a triangle: no pixel centre may fall between two neighbours; also the least area in pixels


@numba.njit(cache=True, nogil=True)
def rasterise(
    corners: Floats, faces: Ints, values: Floats, height: int, width: int, inverse_depth: Floats | None = None
) -> NDArray[np.float32]:
    """Interpolate values (n, k) over triangles with corners (n, 2) = (x right, y down) in pixels, faces (m, 3).

    Where triangles overlap, the last one is shown; with inverse_depth (n,), 1/mm along the line of sight, the nearest
    one (z-buffer), and none that has a corner behind the camera. Interpolation is affine in the picture: for values
    that are affine in space interpolate them times inverse depth, and inverse depth, and divide.
    Returns (height, width, k) float32, NaN where no triangle lies. Pixel centres are at whole numbers.
    """
    picture = np.full((height, width, values.shape[1]), np.nan, np.float32)
    if inverse_depth is not None:
        nearest = np.zeros((height, width))
    for f in range(len(faces)):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        if inverse_depth is not None and min(inverse_depth[i], inverse_depth[j], inverse_depth[k]) <= 0.0:
            continue
        ax, ay = corners[i, 0], corners[i, 1]
        ux, uy = corners[j, 0] - ax, corners[j, 1] - ay
        vx, vy = corners[k, 0] - ax, corners[k, 1] - ay
        area = ux * vy - uy * vx
        if abs(area) < EDGE_TOLERANCE:
            continue
        top, bottom = ay + min(0.0, uy, vy), ay + max(0.0, uy, vy)
        left, right = ax + min(0.0, ux, vx), ax + max(0.0, ux, vx)
        for row in range(max(0, int(np.ceil(top))), min(height - 1, int(np.floor(bottom))) + 1):
            for col in range(max(0, int(np.ceil(left))), min(width - 1, int(np.floor(right))) + 1):
                u = ((col - ax) * vy - (row - ay) * vx) / area
                v = (ux * (row - ay) - uy * (col - ax)) / area
                if u < -EDGE_TOLERANCE or v < -EDGE_TOLERANCE or u + v > 1 + EDGE_TOLERANCE:
                    continue
                if inverse_depth is not None:
                    at = inverse_depth[i]
                    at += u * (inverse_depth[j] - inverse_depth[i]) + v * (inverse_depth[k] - inverse_depth[i])
                    if at <= nearest[row, col]:
                        continue
                    nearest[row, col] = at
                for c in range(values.shape[1]):
                    base = values[i, c]
                    picture[row, col, c] = base + u * (values[j, c] - base) + v * (values[k, c] - base)
    return picture
