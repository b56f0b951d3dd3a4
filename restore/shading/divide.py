"""Removes the light from the pixels of a page."""

from __future__ import annotations

from math import erf, sqrt

import numba
import numpy as np
from numpy.typing import NDArray

from restore.numerics.srgb import LINEAR, srgb_codes
from restore.runtime.threads import in_bands
from restore.scan import Bytes, Mask
from restore.shading.relief import Field
from restore.shading.steps import CELL, Steps

CODES = 4096  # steps of light for the way back to codes: half a code at the dark end, far less elsewhere


def divided(image: Bytes, mask: Mask, scale: float, gain: Field, steps: Steps, most: float) -> Bytes:
    """Multiply a page by a gain of its cells, where masked.

    Between cells the gain is bilinear, except for the steps of the light that it has removed: these are as sharp as the
    page's own pixels show them.
    image: (h, w, 3).
    gain: (r, c, 3), with `scale` cells to a pixel.
    most: the gain is between that and its inverse.
    """
    evened, codes = np.empty_like(image), srgb_codes(np.arange(CODES) / (CODES - 1))
    in_bands(lambda band: _multiply(image, mask, gain, scale, LINEAR, codes, band.start, evened[band]), len(image))
    if steps.found.any():
        at, distance = np.argwhere(steps.found), steps.distance(CELL)
        (top, left), (bottom, right) = at.min(axis=0), at.max(axis=0) + 1
        near = np.s_[top:bottom, left:right]
        # Of what the gain answers for, all but the steps varies slowly.
        rest = gain[near] * steps.sharp[near]
        cells = np.dstack((rest, *(field[near] for field in (steps.light, steps.contrast, steps.place, distance))))
        found = steps.found[near]

        def sharpen(band: slice) -> None:
            _multiply_steps(image, mask, cells, found, top, left, scale, most, LINEAR, codes, band.start, evened[band])

        in_bands(sharpen, len(image))
    return evened


@numba.njit(cache=True, nogil=True)
def _multiply(
    image: Bytes, mask: Mask, gain: Field, scale: float, linear: Field, codes: NDArray[np.uint8], first: int, out: Bytes
) -> None:
    """Multiply the light of every masked pixel by the gain of its cells.

    Interpolated linearly. The rows of the image from `first` on are written to out (some rows, w, 3).
    """
    _, width, _ = image.shape
    rows, cols, _ = gain.shape
    top = np.float32(len(codes) - 1)
    across = np.empty((cols, 3), np.float32)
    left, fraction = np.empty(width, np.uint32), np.empty(width, np.float32)
    for col in range(width):
        x = min(max((col + 0.5) * scale - 0.5, 0.0), cols - 1.0)
        left[col] = min(int(x), max(cols - 2, 0))
        fraction[col] = x - left[col]
    step = np.uint32(1 if cols > 1 else 0)  # without a sign, no index needs a look for negative ones
    for row in range(first, first + len(out)):
        y = min(max((row + 0.5) * scale - 0.5, 0.0), rows - 1.0)
        i = min(int(y), max(rows - 2, 0))
        v = np.float32(y - i)
        below = min(i + 1, rows - 1)
        for c in range(cols):
            for k in range(3):
                across[c, k] = top * (gain[i, c, k] + v * (gain[below, c, k] - gain[i, c, k]))
        before, after, on = image[row], out[row - first], mask[row]
        for col in range(width):
            if not on[col]:
                after[col] = before[col]
                continue
            j, u = left[col], fraction[col]
            for k in range(3):
                here = across[j, k]
                light = linear[before[col, k]] * (here + u * (across[j + step, k] - here))
                after[col, k] = codes[np.uint32(min(light + np.float32(0.5), top))]


@numba.njit(cache=True, nogil=True)
def _multiply_steps(
    image: Bytes,
    mask: Mask,
    cells: Field,
    found: Mask,
    top: int,
    left: int,
    scale: float,
    most: float,
    linear: Field,
    codes: NDArray[np.uint8],
    first: int,
    out: Bytes,
) -> None:
    """Remove the light from every masked pixel between cells with a step.

    For rows from `first` on, into out.
    cells: (r, c, 11), from row `top` and column `left` of the page's on: gain without the light, light with blurred
        steps, contrast of the step, distance from it in widths as blurred, and as the camera drew it.
    """
    rows, cols = found.shape
    full = np.float32(len(codes) - 1)
    here = np.empty(cells.shape[2], np.float32)
    for row in range(first, first + len(out)):
        y = (row + 0.5) * scale - 0.5 - top
        i = int(np.floor(y))
        if not 0 <= i < rows - 1:
            continue
        v = np.float32(y - i)
        for col in range(max(int(left / scale), 0), min(int((left + cols) / scale) + 1, image.shape[1])):
            x = (col + 0.5) * scale - 0.5 - left
            j = int(np.floor(x))
            if not 0 <= j < cols - 1 or not mask[row, col]:
                continue
            if not (found[i, j] and found[i, j + 1] and found[i + 1, j] and found[i + 1, j + 1]):
                continue
            u = np.float32(x - j)
            for n in range(len(here)):
                upper = cells[i, j, n] + u * (cells[i, j + 1, n] - cells[i, j, n])
                lower = cells[i + 1, j, n] + u * (cells[i + 1, j + 1, n] - cells[i + 1, j, n])
                here[n] = upper + v * (lower - upper)
            rise = np.float32((erf(here[10] / sqrt(2.0)) - erf(here[9] / sqrt(2.0))) / 2)
            for k in range(3):
                light = max(here[3 + k] + here[6 + k] * rise, here[k] / np.float32(most))
                gain = max(here[k] / light, np.float32(1 / most))
                value = full * gain * linear[image[row, col, k]]
                out[row - first, col, k] = codes[np.uint32(min(value + np.float32(0.5), full))]
