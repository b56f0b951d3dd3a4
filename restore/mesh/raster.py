"""Rasterises triangles, with or without a z-buffer.

Values given at the corners are interpolated at every pixel centre.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from restore.runtime.threads import in_bands
from restore.scan import Floats, Ints, Mask

EDGE_TOLERANCE = 1e-6  # of a triangle: no pixel centre may fall between two neighbours; also the least area in pixels
FARTHEST = 1e9  # pixels: in a sliver that reaches ten times as far, rounding is as much as EDGE_TOLERANCE
PICTURE_BANDS = 4  # that one is drawn in: each looks through all triangles


def rasterise(
    corners: Floats, faces: Ints, values: Floats, height: int, width: int, inverse_depth: Floats | None = None
) -> NDArray[np.float32]:
    """Interpolate values over triangles.

    Where triangles overlap, the last one is shown; with inverse_depth the nearest one (z-buffer), and none that has a
    corner behind the camera. Interpolation is affine in the image: for values that are affine in space interpolate them
    times inverse depth, and inverse depth, and divide. Triangles with a corner that is farther than FARTHEST, or not
    finite, are not shown.
    corners: (n, 2) pixels, x right, y down; pixel centres are at whole numbers.
    faces: (m, 3).
    values: (n, k).
    inverse_depth: (n,) 1/mm, along the line of sight.
    Returns (height, width, k) float32, NaN outside all triangles.
    """
    picture = np.empty((height, width, values.shape[1]), np.float32)
    # Two extremes are cheap, and hardly ever so far out; no comparison with NaN is true.
    if not (corners.min(initial=0.0) > -FARTHEST and corners.max(initial=0.0) < FARTHEST):
        near: Mask = np.all(np.abs(corners) < FARTHEST, axis=1)
        faces = faces[near[faces].all(axis=1)]

    corners, values = np.ascontiguousarray(corners), np.ascontiguousarray(values)
    faces = np.ascontiguousarray(faces)
    near_by = np.empty(0) if inverse_depth is None else np.ascontiguousarray(inverse_depth)

    def draw(rows: slice) -> None:
        picture[rows] = np.nan
        nearest = np.zeros((0 if inverse_depth is None else rows.stop - rows.start, width))
        _draw(corners, faces, values, near_by, nearest, rows.start, rows.stop, picture)

    in_bands(draw, height, -(-height // PICTURE_BANDS) or 1)
    return picture


@numba.njit(cache=True, nogil=True)
def _draw(
    corners: Floats, faces: Ints, values: Floats, inverse_depth: Floats, nearest: Floats, first: int, end: int,
    picture: NDArray[np.float32],
) -> None:  # fmt: skip
    """Draw the rows of a NaN picture (height, width, k) from first to end.

    nearest: (end − first, width), z-buffer of zeros; without rows neither it nor inverse depths are used.
    """
    width, hides = picture.shape[1], len(nearest) > 0
    for f in range(len(faces)):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        ay, uy, vy = corners[i, 1], corners[j, 1] - corners[i, 1], corners[k, 1] - corners[i, 1]
        top, bottom = ay + min(0.0, uy, vy), ay + max(0.0, uy, vy)
        if not (bottom >= first and top < end):
            continue
        if hides and min(inverse_depth[i], inverse_depth[j], inverse_depth[k]) <= 0.0:
            continue
        ax, ux, vx = corners[i, 0], corners[j, 0] - corners[i, 0], corners[k, 0] - corners[i, 0]
        area = ux * vy - uy * vx
        if abs(area) < EDGE_TOLERANCE:
            continue
        left, right = ax + min(0.0, ux, vx), ax + max(0.0, ux, vx)
        for row in range(max(first, int(np.ceil(top))), min(end, int(np.floor(bottom)) + 1)):
            for col in range(max(0, int(np.ceil(left))), min(width - 1, int(np.floor(right))) + 1):
                u = ((col - ax) * vy - (row - ay) * vx) / area
                v = (ux * (row - ay) - uy * (col - ax)) / area
                if u < -EDGE_TOLERANCE or v < -EDGE_TOLERANCE or u + v > 1 + EDGE_TOLERANCE:
                    continue
                if hides:
                    at = inverse_depth[i]
                    at += u * (inverse_depth[j] - inverse_depth[i]) + v * (inverse_depth[k] - inverse_depth[i])
                    if at <= nearest[row - first, col]:
                        continue
                    nearest[row - first, col] = at
                for c in range(values.shape[1]):
                    base = values[i, c]
                    picture[row, col, c] = base + u * (values[j, c] - base) + v * (values[k, c] - base)
