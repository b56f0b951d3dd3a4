"""Meshes over ordered grids: their type, and the triangles between neighbours."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import sqrt

import numba
import numpy as np

from restore.numerics.limits import TINY
from restore.scan import Floats, Ints, Mask, SurfaceMesh

MIN_FRACTION = 0.2  # of a window must be points of one piece: at a corner of the grid a quarter is
TERMS = 6  # of a patch: height, two slopes, three second derivatives
RIDGE = 1e-6  # of the points of a patch: its terms are determined also where these lie in one line


@dataclass(frozen=True, eq=False)
class GridMesh(SurfaceMesh):
    """Surface mesh over an ordered grid, as the segments of CT volumes are.

    It may wind round several times.

    shape   (rows, cols) of the grid. Its columns run to the right of the page, its rows down.
    places  (n,) int64: row · cols + col of every vertex, ascending; the other places of the grid have no valid point.
    """

    shape: tuple[int, int] = (0, 0)
    places: Ints = field(default_factory=lambda: np.empty(0, np.int64))


@numba.njit(cache=True)
def grid_faces(valid: Mask) -> Ints:
    """Return triangles between neighbouring valid points of a grid.

    They run counter-clockwise where columns go right and rows down. A cell with three valid corners has one triangle.
    valid: (rows, cols).
    Returns (m, 3), numbering the valid points row by row.
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


@numba.njit(cache=True)
def fit_patches(
    points: Floats, pieces: Ints, sizes: Ints, rows: Ints, cols: Ints, reach: int
) -> tuple[Floats, Floats, Ints]:
    """Fit quadratic patches at the nodes of a grid.

    points: (rows, cols, 3) mm, NaN where missing.
    pieces: (rows, cols), the piece of each point.
    sizes: number of points of each piece.
    rows, cols: (k,) and (l,), lines of the nodes.
    reach: points of a window to either side.
    Returns positions (k, l, 3) mm, unit normals (k, l, 3), and the piece (k, l) of each node, that of the next point;
    NaN and −1 where too few points of it are in the window.
    """
    positions = np.full((len(rows), len(cols), 3), np.nan)
    normals, own = positions.copy(), np.full((len(rows), len(cols)), -1)
    least = max(TERMS, int(MIN_FRACTION * (2 * reach + 1) ** 2))
    matrix, right, terms = np.empty((TERMS, TERMS)), np.empty((TERMS, 3)), np.empty(TERMS)
    for k in range(len(rows)):
        for m in range(len(cols)):
            top, bottom = max(rows[k] - reach, 0), min(rows[k] + reach + 1, points.shape[0])
            left, end = max(cols[m] - reach, 0), min(cols[m] + reach + 1, points.shape[1])
            nearest, piece = np.inf, -1
            for row in range(top, bottom):
                for col in range(left, end):
                    away = (row - rows[k]) ** 2 + (col - cols[m]) ** 2
                    if away < nearest and sizes[row, col] >= least and not np.isnan(points[row, col, 0]):
                        nearest, piece = away, pieces[row, col]
            matrix[:], right[:], count = 0.0, 0.0, 0
            for row in range(top, bottom):
                for col in range(left, end):
                    if pieces[row, col] != piece or np.isnan(points[row, col, 0]):
                        continue
                    count += 1
                    u, v = (col - cols[m]) / reach, (row - rows[k]) / reach
                    terms[0], terms[1], terms[2], terms[3], terms[4], terms[5] = 1.0, u, v, u * u, u * v, v * v
                    for p in range(TERMS):
                        for q in range(TERMS):
                            matrix[p, q] += terms[p] * terms[q]
                        for axis in range(3):
                            right[p, axis] += terms[p] * points[row, col, axis]
            if piece < 0 or count < least:
                continue
            for p in range(1, TERMS):
                matrix[p, p] += RIDGE * count
            patch = np.linalg.solve(matrix, right)
            across = np.cross(patch[1], patch[2])
            own[k, m] = piece
            positions[k, m] = patch[0]
            normals[k, m] = across / max(sqrt((across * across).sum()), TINY)
    return positions, normals, own
