"""Samples a picture at given positions.

Prefiltered where the samples are coarser than its pixels.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from restore.scan import Bytes, Floats

MAX_TAPS = 64  # along each axis: a page pixel averages at most 16 × 16 of the picture's, which bounds the time
# Up to a step of MAX_SHARP_STEP pixels only periods below 2.5 pixels of the picture alias, which no lens shows with
# contrast. From there the kernel widens, by WIDTH_GROWTH per pixel of step until it is as wide as the step.
MAX_SHARP_STEP, WIDTH_GROWTH = 1.25, 6.0


@numba.njit(cache=True, inline="always")
def _kernel(t: float) -> float:
    t = abs(t)
    if t < 1.0:
        return 1.0 + t * t * (-2.5 + 1.5 * t)
    if t < 2.0:
        return 2.0 + t * (-4.0 + t * (2.5 - 0.5 * t))
    return 0.0


@numba.njit(cache=True, inline="always")
def _fill_taps(position: float, scale: float, size: int, weights: Floats, indices: NDArray[np.int64]) -> int:
    """Write indices and weights (of sum one) of the taps round a position; return how many.

    Beyond the border the last pixel is replicated.
    """
    first = int(np.ceil(position - 2.0 * scale))
    last = int(np.floor(position + 2.0 * scale))
    count = min(last - first + 1, MAX_TAPS)
    total = 0.0
    for n in range(count):
        weights[n] = _kernel((first + n - position) / scale)
        total += weights[n]
        indices[n] = min(max(first + n, 0), size - 1)
    for n in range(count):
        weights[n] /= total
    return count


@numba.njit(cache=True)
def _source_step(source: NDArray[np.float32], row: int, col: int, k: int) -> float:
    """Return the picture's distance of neighbouring page pixels along its axis k, pixels."""
    rows, cols, _ = source.shape
    here = source[row, col, k]
    right = _lesser(
        source[row, col + 1, k] - here if col + 1 < cols else np.nan, here - source[row, col - 1, k] if col else np.nan
    )
    down = _lesser(
        source[row + 1, col, k] - here if row + 1 < rows else np.nan, here - source[row - 1, col, k] if row else np.nan
    )
    return np.sqrt(right * right + down * down)


@numba.njit(cache=True, inline="always")
def _lesser(ahead: float, back: float) -> float:
    """Return the lesser step of two.

    One of them may jump from chart to chart of an atlas; 0 where neither is a number.
    """
    if np.isnan(ahead) or abs(back) < abs(ahead):
        return 0.0 if np.isnan(back) else back
    return ahead


@numba.njit(cache=True, inline="always")
def _kernel_scale(step: float) -> float:
    """Return the scale of the kernel for a step of page pixels.

    Neighbouring ones are a step apart in the picture.
    """
    return min(max(1.0, min(step, 1.0 + WIDTH_GROWTH * (step - MAX_SHARP_STEP))), MAX_TAPS / 4.0 - 1.0)


@numba.njit(cache=True, inline="always")
def _catmull_rom(t: Any) -> tuple[Any, Any, Any, Any]:
    """Catmull-Rom weights of the four pixels round a position t beyond the second."""
    half, one, two, more, most = np.float32(0.5), np.float32(1), np.float32(2), np.float32(1.5), np.float32(2.5)
    last = t * t * (half * t - half)
    return t * (t * (one - half * t) - half), one + t * t * (more * t - most), t * (half + t * (two - more * t)), last


@numba.njit(cache=True, inline="always")
def _column(codes: Bytes, top: int, below: int, v: tuple[Any, Any, Any, Any]) -> Any:
    """Weight four codes of a channel that stand one below the other."""
    return v[0] * codes[top] + v[1] * codes[top + below] + v[2] * codes[top + 2 * below] + v[3] * codes[top + 3 * below]


@numba.njit(cache=True, inline="always")
def _sample_catmull_rom(codes: Bytes, width: int, x: float, y: float, out: NDArray[np.float32]) -> None:
    """Interpolate a picture inside it from 4 × 4 pixels, into out (3,).

    The sums stay in registers: kept in an array they take half as long again.
    codes: (H · W · 3).
    """
    left, top = int(np.floor(x)), int(np.floor(y))
    u, v = _catmull_rom(x - np.float32(left)), _catmull_rom(y - np.float32(top))
    first, below = 3 * ((top - 1) * width + left - 1), 3 * width
    for k in range(3):
        a = first + k
        code = u[0] * _column(codes, a, below, v) + u[1] * _column(codes, a + 3, below, v)
        code = code + u[2] * _column(codes, a + 6, below, v) + u[3] * _column(codes, a + 9, below, v)
        out[k] = min(max(code, np.float32(0)), np.float32(255))


@numba.njit(cache=True, inline="always")
def _is_oversampled(source: NDArray[np.float32], row: int, col: int, limit: float) -> bool:
    """Return whether a kernel of 4 × 4 pixels suffices.

    For the step to the next page pixels; False next to NaN.
    """
    rows, cols, _ = source.shape
    if row + 1 >= rows or col + 1 >= cols:
        return False
    for k in range(2):
        right, down = source[row, col + 1, k] - source[row, col, k], source[row + 1, col, k] - source[row, col, k]
        if not right * right + down * down <= limit:
            return False
    return True


def sample_scaled(picture: Bytes, source: NDArray[np.float32]) -> NDArray[np.float32]:
    """Sample a picture, with a kernel for the scale of the page.

    Catmull-Rom interpolation (1974); where page pixels are more than a picture's pixel apart, its kernel is as much
    wider, so that all pixels between them contribute.
    picture: (H, W, 3).
    source: (h, w, 2), positions.
    Returns codes (h, w, 3) float32, 0 where positions are NaN.
    """
    image = np.zeros((*source.shape[:2], 3), np.float32)
    weights, indices = np.empty((2, MAX_TAPS)), np.empty((2, MAX_TAPS), np.int64)
    picture = np.ascontiguousarray(picture)
    _sample(picture, picture.reshape(-1), np.ascontiguousarray(source), image, *weights, *indices)
    return image


@numba.njit(cache=True, nogil=True)
def _sample(
    picture: Bytes, codes: Bytes, source: NDArray[np.float32], image: NDArray[np.float32],
    wx: Floats, wy: Floats, ax: NDArray[np.int64], ay: NDArray[np.int64],
) -> None:  # fmt: skip
    """Sample as `sample_scaled`, into an image of zeros.

    codes: (H · W · 3), those of the picture; the last arguments are scratch.
    """
    height, width, _ = picture.shape
    rows, cols, _ = source.shape
    limit = np.float32(MAX_SHARP_STEP**2)
    for row in range(rows):
        for col in range(cols):
            x, y = source[row, col, 0], source[row, col, 1]
            if np.isnan(x):
                continue
            if 1 <= x < width - 2 and 1 <= y < height - 2 and _is_oversampled(source, row, col, limit):
                _sample_catmull_rom(codes, width, x, y, image[row, col])
                continue
            sx, sy = _kernel_scale(_source_step(source, row, col, 0)), _kernel_scale(_source_step(source, row, col, 1))
            across, down = _fill_taps(x, sx, width, wx, ax), _fill_taps(y, sy, height, wy, ay)
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
