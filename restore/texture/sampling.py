"""Read a picture at the places that a page asks for, without skipping pixels where the page is coarser."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from restore.scan import Bytes, Floats

MAX_TAPS = 64  # a page pixel averages at most 16 × 16 of the picture's: coarser pages are no reason to wait
# A page so little coarser than its picture would fold back only what is finer than 2.5 pixels of the picture, which no
# lens shows with contrast. From there on the kernel grows, and soon is as wide as it must be.
SHARP, GROWTH = 1.25, 6.0
# Sums may be reordered, and divided by their inverse; NaN must stay what it is.
FAST = {"contract", "reassoc", "arcp", "nsz"}


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


@numba.njit(cache=True)
def _stretch(step: float) -> float:
    """How wide the kernel is where page pixels lie a step apart in the picture."""
    return min(max(1.0, min(step, 1.0 + GROWTH * (step - SHARP))), MAX_TAPS / 4.0 - 1.0)


@numba.njit(cache=True, fastmath=FAST)
def _catmull_rom(t: Any) -> tuple[Any, Any, Any, Any]:
    """Weights of the four pixels round a place t beyond the second."""
    half, one, two, more, most = np.float32(0.5), np.float32(1), np.float32(2), np.float32(1.5), np.float32(2.5)
    last = t * t * (half * t - half)
    return t * (t * (one - half * t) - half), one + t * t * (more * t - most), t * (half + t * (two - more * t)), last


@numba.njit(cache=True, fastmath=FAST)
def _sharp(codes: Bytes, width: int, x: float, y: float, line: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    """Read a picture's codes (H · W · 3) at a place inside it, from the 4 × 4 pixels round it."""
    left, top = int(np.floor(x)), int(np.floor(y))
    u, v = _catmull_rom(x - np.float32(left)), _catmull_rom(y - np.float32(top))
    a, below = 3 * ((top - 1) * width + left - 1), 3 * width
    b, c, d = a + below, a + 2 * below, a + 3 * below
    for n in range(12):  # columns first: their codes lie side by side
        line[n] = v[0] * codes[a + n] + v[1] * codes[b + n] + v[2] * codes[c + n] + v[3] * codes[d + n]
    for k in range(3):
        code = u[0] * line[k] + u[1] * line[3 + k] + u[2] * line[6 + k] + u[3] * line[9 + k]
        out[k] = min(max(code, np.float32(0)), np.float32(255))


@numba.njit(cache=True)
def _is_fine(source: NDArray[np.float32], row: int, col: int, limit: float) -> bool:
    """Whether the next page pixels lie so near in the picture that 4 × 4 of its pixels are enough; not beside NaN."""
    rows, cols, _ = source.shape
    if row + 1 >= rows or col + 1 >= cols:
        return False
    for k in range(2):
        right, down = source[row, col + 1, k] - source[row, col, k], source[row + 1, col, k] - source[row, col, k]
        if not right * right + down * down <= limit:
            return False
    return True


@numba.njit(cache=True, nogil=True)
def sample_scaled(picture: Bytes, source: NDArray[np.float32]) -> NDArray[np.float32]:
    """(h, w, 3) float32 codes of a picture (H, W, 3) at positions (h, w, 2), 0 where they are NaN.

    Catmull-Rom interpolation (1974); where page pixels lie more than a picture's pixel apart, its kernel is as much
    wider, so that all pixels between count.
    """
    height, width, _ = picture.shape
    rows, cols, _ = source.shape
    image = np.zeros((rows, cols, 3), np.float32)
    codes, line, limit = picture.reshape(-1), np.empty(12, np.float32), np.float32(SHARP**2)
    wx, wy = np.empty(MAX_TAPS), np.empty(MAX_TAPS)
    ax, ay = np.empty(MAX_TAPS, np.int64), np.empty(MAX_TAPS, np.int64)
    for row in range(rows):
        for col in range(cols):
            x, y = source[row, col, 0], source[row, col, 1]
            if np.isnan(x):
                continue
            if 1 <= x < width - 2 and 1 <= y < height - 2 and _is_fine(source, row, col, limit):
                _sharp(codes, width, x, y, line, image[row, col])
                continue
            sx, sy = _stretch(_step(source, row, col, 0)), _stretch(_step(source, row, col, 1))
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
