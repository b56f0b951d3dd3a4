"""Fill triangles: any values given at the corners, interpolated at every pixel centre."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from restore.scan import Floats, Ints

HAIR = 1e-6  # of a triangle: no pixel may fall between two neighbours


@numba.njit(cache=True, nogil=True)
def rasterise(corners: Floats, faces: Ints, values: Floats, height: int, width: int) -> NDArray[np.float32]:
    """Interpolate values (n, k) over triangles with corners (n, 2) = (x right, y down) in pixels, faces (m, 3).

    Returns (height, width, k) float32, NaN where no triangle lies. Pixel centres are at whole numbers.
    """
    picture = np.full((height, width, values.shape[1]), np.nan, np.float32)
    for f in range(len(faces)):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        ax, ay = corners[i, 0], corners[i, 1]
        ux, uy = corners[j, 0] - ax, corners[j, 1] - ay
        vx, vy = corners[k, 0] - ax, corners[k, 1] - ay
        area = ux * vy - uy * vx
        if abs(area) < HAIR:
            continue
        top, bottom = ay + min(0.0, uy, vy), ay + max(0.0, uy, vy)
        left, right = ax + min(0.0, ux, vx), ax + max(0.0, ux, vx)
        for row in range(max(0, int(np.ceil(top))), min(height - 1, int(np.floor(bottom))) + 1):
            for col in range(max(0, int(np.ceil(left))), min(width - 1, int(np.floor(right))) + 1):
                u = ((col - ax) * vy - (row - ay) * vx) / area
                v = (ux * (row - ay) - uy * (col - ax)) / area
                if u < -HAIR or v < -HAIR or u + v > 1 + HAIR:
                    continue
                for c in range(values.shape[1]):
                    base = values[i, c]
                    picture[row, col, c] = base + u * (values[j, c] - base) + v * (values[k, c] - base)
    return picture
