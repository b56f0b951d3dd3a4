"""Removes the light from the pixels of a page."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
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
BACK = srgb_codes(np.arange(CODES) / (CODES - 1))


@dataclass(frozen=True, eq=False)
class Division:
    """Multiplies a page by a gain of its cells.

    Between cells the gain is bilinear, except for the steps of the light that it has removed: these are as sharp as the
    page's own pixels show them.
    gain   (r, c, 3).
    most   the gain is between that and its inverse.
    """

    gain: Field
    steps: Steps
    most: float

    def divided(self, image: Bytes, mask: Mask, scale: float, top: int = 0) -> Bytes:
        """Return rows (h, w, 3) of a page multiplied where masked.

        top: the first of them. scale: cells to a pixel.
        """
        evened = np.empty_like(image)

        def multiply(rows: slice) -> None:
            picture, on, first, out = image[rows], mask[rows], top + rows.start, evened[rows]
            _multiply(picture, on, self.gain, scale, LINEAR, BACK, first, out)
            if self._near is not None:
                _multiply_steps(picture, on, *self._near, scale, self.most, LINEAR, BACK, first, out)

        in_bands(multiply, len(image))
        return evened

    @cached_property
    def _near(self) -> tuple[Field, Mask, int, int] | None:
        """Return the cells next to steps, which are steps, and the first row and column."""
        steps = self.steps
        if not steps.found.any():
            return None
        at, distance = np.argwhere(steps.found), steps.distance(CELL)
        (top, left), (bottom, right) = at.min(axis=0).tolist(), (at.max(axis=0) + 1).tolist()
        near = np.s_[top:bottom, left:right]
        # Of what the gain answers for, all but the steps varies slowly.
        rest = self.gain[near] * steps.sharp[near]
        cells = np.dstack((rest, *(field[near] for field in (steps.light, steps.contrast, steps.place, distance))))
        return cells, steps.found[near], top, left


@numba.njit(cache=True, nogil=True)
def _multiply(
    image: Bytes, mask: Mask, gain: Field, scale: float, linear: Field, codes: NDArray[np.uint8], first: int, out: Bytes
) -> None:
    """Multiply the light of masked pixels by the cells' gain, interpolated linearly.

    The image has the rows of the page from `first` on; out (some rows, w, 3).
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
    for row in range(len(out)):
        y = min(max((first + row + 0.5) * scale - 0.5, 0.0), rows - 1.0)
        i = min(int(y), max(rows - 2, 0))
        v = np.float32(y - i)
        below = min(i + 1, rows - 1)
        for c in range(cols):
            for k in range(3):
                across[c, k] = top * (gain[i, c, k] + v * (gain[below, c, k] - gain[i, c, k]))
        before, after, on = image[row], out[row], mask[row]
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

    The image has the rows from `first` on.
    cells: (r, c, 11), from row `top` and column `left` of the page's on: gain without the light, light with blurred
        steps, contrast of the step, distance from it in widths as blurred, and as the camera drew it.
    """
    rows, cols = found.shape
    full = np.float32(len(codes) - 1)
    here = np.empty(cells.shape[2], np.float32)
    for row in range(len(out)):
        y = (first + row + 0.5) * scale - 0.5 - top
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
                out[row, col, k] = codes[np.uint32(min(value + np.float32(0.5), full))]
