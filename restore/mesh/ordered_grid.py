"""Meshes over ordered grids: their type, and the triangles between neighbours."""

from __future__ import annotations

from dataclasses import dataclass, field

import numba
import numpy as np

from restore.scan import Ints, Mask, SurfaceMesh


@dataclass(frozen=True, eq=False)
class GridMesh(SurfaceMesh):
    """A surface mesh over an ordered grid, as the segments of CT volumes are: it may wind round several times.

    shape   (rows, cols) of the grid. Its columns run to the right of the page, its rows down.
    places  (n,) int64: row · cols + col of every vertex, ascending; the other places of the grid have no valid point.
    """

    shape: tuple[int, int] = (0, 0)
    places: Ints = field(default_factory=lambda: np.empty(0, np.int64))


@numba.njit(cache=True)
def grid_faces(valid: Mask) -> Ints:
    """(m, 3) triangles between neighbouring valid points (rows, cols), numbered row by row, the valid ones only.

    They run counter-clockwise where columns go right and rows down. A cell with three valid corners has one triangle.
    """
    rows, cols = valid.shape
    number, count = np.full((rows, cols), -1), 0
    for row in range(rows):
        for col in range(cols):
            if valid[row, col]:
                number[row, col], count = count, count + 1
    faces, found, corners = np.empty((2 * max(rows - 1, 0) * max(cols - 1, 0), 3), np.int64), 0, np.empty(4, np.int64)
    for row in range(rows - 1):
        for col in range(cols - 1):
            known = 0
            for down, right in ((0, 0), (1, 0), (1, 1), (0, 1)):
                if valid[row + down, col + right]:
                    corners[known], known = number[row + down, col + right], known + 1
            if known > 2:
                faces[found, 0], faces[found, 1], faces[found, 2], found = corners[0], corners[1], corners[2], found + 1
            if known > 3:
                faces[found, 0], faces[found, 1], faces[found, 2], found = corners[0], corners[2], corners[3], found + 1
    return faces[:found].copy()
