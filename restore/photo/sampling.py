"""Read a picture at the places that a page asks for, without skipping pixels where the page is coarser."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from restore.scan import Bytes, Floats

MAX_TAPS = 64  # a page pixel averages at most 16 × 16 of the picture's: coarser pages are no reason to wait


@numba.njit(cache=True)
def _kernel(t: float) -> float:
    t = abs(t)
    if t < 1.0:
        return 1.0 + t * t * (-2.5 + 1.5 * t)
    if t < 2.0:
        return 2.0 + t * (-4.0 + t * (2.5 - 0.5 * t))
    return 0.0


@numba.njit(cache=True)
def _fill(place: float, stretch: float, size: int, weights: Floats, at: NDArray[np.int64]) -> int:
    """Taps round a place and their weights, which sum to one; beyond the border the last pixel goes on."""
    first = int(np.ceil(place - 2.0 * stretch))
    last = int(np.floor(place + 2.0 * stretch))
    count = min(last - first + 1, MAX_TAPS)
    total = 0.0
    for n in range(count):
        weights[n] = _kernel((first + n - place) / stretch)
        total += weights[n]
        at[n] = min(max(first + n, 0), size - 1)
    for n in range(count):
        weights[n] /= total
    return count


@numba.njit(cache=True)
def _step(source: NDArray[np.float32], row: int, col: int, k: int) -> float:
    """How far neighbouring page pixels lie apart in the picture, along its axis k."""
    rows, cols, _ = source.shape
    right = source[row, col + 1, k] - source[row, col, k] if col + 1 < cols else np.nan
    if np.isnan(right):
        right = source[row, col, k] - source[row, col - 1, k] if col else 0.0
    down = source[row + 1, col, k] - source[row, col, k] if row + 1 < rows else np.nan
    if np.isnan(down):
        down = source[row, col, k] - source[row - 1, col, k] if row else 0.0
    step = np.sqrt(right * right + down * down)
    return step if step >= 0.0 else 0.0


@numba.njit(cache=True, nogil=True)
def sample_scaled(picture: Bytes, source: NDArray[np.float32]) -> NDArray[np.float32]:
    """(h, w, 3) float32 codes of a picture (H, W, 3) at positions (h, w, 2), 0 where they are NaN.

    Catmull-Rom interpolation (1974); where page pixels lie more than a picture's pixel apart, its kernel is as much
    wider, so that all pixels between count.
    """
    height, width, _ = picture.shape
    rows, cols, _ = source.shape
    image = np.zeros((rows, cols, 3), np.float32)
    wx, wy = np.empty(MAX_TAPS), np.empty(MAX_TAPS)
    ax, ay = np.empty(MAX_TAPS, np.int64), np.empty(MAX_TAPS, np.int64)
    for row in range(rows):
        for col in range(cols):
            x, y = source[row, col, 0], source[row, col, 1]
            if np.isnan(x):
                continue
            widest = MAX_TAPS / 4.0 - 1.0
            sx = min(max(_step(source, row, col, 0), 1.0), widest)
            sy = min(max(_step(source, row, col, 1), 1.0), widest)
            across, down = _fill(x, sx, width, wx, ax), _fill(y, sy, height, wy, ay)
            red, green, blue = 0.0, 0.0, 0.0
            for i in range(down):
                r, g, b = 0.0, 0.0, 0.0
                for j in range(across):
                    r += wx[j] * picture[ay[i], ax[j], 0]
                    g += wx[j] * picture[ay[i], ax[j], 1]
                    b += wx[j] * picture[ay[i], ax[j], 2]
                red += wy[i] * r
                green += wy[i] * g
                blue += wy[i] * b
            image[row, col, 0] = min(max(red, 0.0), 255.0)
            image[row, col, 1] = min(max(green, 0.0), 255.0)
            image[row, col, 2] = min(max(blue, 0.0), 255.0)
    return image
