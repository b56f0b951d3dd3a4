"""Projector coordinates of a camera's lines of sight, from pattern edges round each."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from restore.scan import Floats, Mask
from restore.structured_light.decode import Axis, Codes, Crossings

MIN_EDGES = 6  # twice the unknowns of a plane
MAX_VARIANCE = 1 / 3  # of that of an edge: samples have about equal noise, or the least certain look like outliers
MAX_RESIDUAL = 0.25  # projector pixels: on one surface edges lie within a tenth, on two they are whole pixels apart
# A pixel's code is its coordinate rounded, and its own edges are known to a quarter of a pixel wherever they count.
ROUNDED = 0.5 + 0.25
WIDER = 2.0  # window where stripes are wide, as on a slope that faces away from the projector
SHIFTS = np.array([[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1], [-1, -1], [1, -1], [-1, 1], [1, 1]], np.float64)


def locate(axis: Axis, lit: Mask, pixels: Floats, radius: float, reach: float) -> Floats:
    """Locate pixels of the camera in the projector's picture.

    The coordinate is that of the plane that fits best, by least squares, the edges of the pattern in a window. Where
    stripes are wide the window is wider, and next to a step of the surface it is shifted to where one plane fits
    (shiftable windows, after Kuwahara 1976). The plane must be certain there, and agree with the nearest code.
    lit: (h, w), the pixels to look at.
    pixels: (n, 2), of the camera.
    radius: of the window, pixels.
    reach: of the nearest code, pixels.
    Returns (n,), NaN where the pattern does not determine it.
    """
    return _locate(axis.code, axis.across, axis.down, lit, np.ascontiguousarray(pixels, np.float64), radius, reach)


@numba.njit(cache=True, nogil=True)
def _locate(
    code: Codes, across: Crossings, down: Crossings, lit: Mask, pixels: Floats, radius: float, reach: float
) -> Floats:
    found = np.full(len(pixels), np.nan)
    for n in range(len(pixels)):
        x, y = pixels[n]
        row, col = int(np.rint(y)), int(np.rint(x))
        if not (0 <= row < code.shape[0] and 0 <= col < code.shape[1] and lit[row, col]):
            continue
        row, col = _nearest(code, x, y, reach)
        if row < 0:
            continue
        best = MAX_RESIDUAL
        for window in (radius, WIDER * radius):
            for k in range(len(SHIFTS)):
                middle = SHIFTS[k] * window
                plane, residual = _plane(code, across, down, x, y, middle[0], middle[1], window)
                own = plane[0] + plane[1] * (col - x) + plane[2] * (row - y)
                if residual < best and abs(own - code[row, col]) <= ROUNDED:
                    best, found[n] = residual, plane[0]
                    if k == 0:
                        break
            if best < MAX_RESIDUAL:
                break
    return found


@numba.njit(cache=True, nogil=True)
def _nearest(code: Codes, x: float, y: float, reach: float) -> tuple[int, int]:
    """Return row and column of the nearest coded pixel to (x, y), −1 beyond reach."""
    best, found = np.inf, (-1, -1)
    for row in range(max(int(np.ceil(y - reach)), 0), min(int(np.floor(y + reach)), code.shape[0] - 1) + 1):
        for col in range(max(int(np.ceil(x - reach)), 0), min(int(np.floor(x + reach)), code.shape[1] - 1) + 1):
            squared = (row - y) ** 2 + (col - x) ** 2
            if code[row, col] >= 0 and squared < best:
                best, found = squared, (row, col)
    return found


@numba.njit(cache=True, nogil=True)
def _plane(
    code: Codes, across: Crossings, down: Crossings, x: float, y: float, right: float, below: float, radius: float
) -> tuple[NDArray[np.floating[Any]], float]:
    """Fit a plane through the edges round (x + right, y + below).

    Returns its value at (x, y) and slopes, and the rms residual, inf where the edges determine no plane.
    """
    rows, cols = code.shape
    normal, side = np.zeros((3, 3)), np.zeros(3)
    squares, count = 0.0, 0
    first_row, last_row = max(int(np.floor(y + below - radius)), 0), min(int(np.ceil(y + below + radius)), rows - 1)
    first_col, last_col = max(int(np.floor(x + right - radius)), 0), min(int(np.ceil(x + right + radius)), cols - 1)
    base = 0
    for row in range(first_row, last_row + 1):
        for col in range(first_col, last_col + 1):
            for way in range(2):
                if way == 0:
                    if col + 1 >= cols or np.isnan(across[row, col]):
                        continue
                    dx, dy, other = col + across[row, col] - x, row - y, code[row, col + 1]
                else:
                    if row + 1 >= rows or np.isnan(down[row, col]):
                        continue
                    dx, dy, other = col - x, row + down[row, col] - y, code[row + 1, col]
                if abs(dx - right) > radius or abs(dy - below) > radius:
                    continue
                if count == 0:
                    base = code[row, col]  # near the values: their squares must not cancel
                value = min(code[row, col], other) + 0.5 - base
                design = (1.0, dx, dy)
                for i in range(3):
                    side[i] += design[i] * value
                    for j in range(3):
                        normal[i, j] += design[i] * design[j]
                squares += value * value
                count += 1
    if count < MIN_EDGES:
        return side, np.inf
    minor = normal[1, 1] * normal[2, 2] - normal[1, 2] ** 2
    determinant = float(np.linalg.det(normal))
    # Their ratio is the variance of the plane at (x, y), in units of that of one edge.
    if not determinant > 0.0 or minor > MAX_VARIANCE * determinant:
        return side, np.inf
    plane = np.linalg.solve(normal, side)
    residual = float(np.sqrt(max(squares - float(plane @ side), 0.0) / count))
    plane[0] += base
    return plane, residual
