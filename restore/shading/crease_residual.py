"""Residual light along creases and shadow edges.

Their position is uncertain by about one cell. A line that follows a crease and is darker or lighter than the page on
both of its sides counts as shading: print is independent of where the page is folded.
"""

from __future__ import annotations

import cv2
import numba
import numpy as np

from restore.numerics.limits import SINGLE_TINY
from restore.numerics.robust import MAJORITY
from restore.range_image.border import STEEPEST
from restore.runtime.threads import in_bands
from restore.scan import Mask
from restore.shading.relief import Field

TENSOR = 3.0  # cells over which the direction of a crease is asked
STEP = 0.02  # of the light, from a cell to the next: curved pages have less, creases more
ALONG = 12  # cells to either side, 5 mm: a word, and the gaps round it
# cells: where the page on either side is looked at; among them are, in small print, a line and a gap.
FLANKS = (-9, -7, -5, 5, 7, 9)
BRIGHT = 0.9  # of the cells along the crease are darker than its paper: what lies between lines and letters
ABOVE = 2 * ALONG - int(BRIGHT * 2 * ALONG)  # this many of them may be brighter
PASSES = 2  # the second time the sides are free of the lines that lie in them
LEAST, MOST = 0.45, 1.6  # of its sides: what is less or more is a printed line, or the gap between two figures
SAME = 0.2  # of one another: light does alike to the darkest channel and to the brightest, ink does not
SOFT = 0.5  # cells
OPEN = 0.8  # of the room: with less in sight a place lies in a hollow, such as the gutter of a book
FARTHEST = 1.0 / STEEPEST  # stretch, beyond which nothing is measured


def crease_light(
    darkest: Field, brightest: Field, expected: Field, inside: Mask, openness: Field, stretch: Field
) -> Field:
    """Return the light along creases and in hollows, relative to their sides.

    darkest, brightest: (r, c), channel of the page in units of the known light.
    expected: (r, c), that light; its steps show where creases and the edges of shadows are.
    openness: (r, c), fraction of the room that is seen; where it is small, shadows and reflections of the page on
        itself are finer than its horizon map.
    stretch: (r, c), cells of the page to one of the page seen from above.
    Returns (r, c), 1 away from creases and hollows.
    """
    across, found = _directions(expected, openness, inside)
    out = np.ones_like(darkest)
    if not found.any():
        return out
    for _ in range(PASSES):
        one, other = (
            _compared(channel / out, across * stretch[..., None], found, inside) for channel in (darkest, brightest)
        )
        line = np.where(np.abs(one - other) < SAME * np.maximum(one, other), np.sqrt(one * other), np.float32(1))
        out *= cv2.GaussianBlur(line, (0, 0), SOFT)
    return out


def _compared(brightness: Field, across: Field, found: Mask, inside: Mask) -> Field:
    """Return the ratio (r, c) of a line to its sides: 0 if not shading, 1 without a line."""
    reach = 2 * int(max(FLANKS) * FARTHEST) + 1
    near = cv2.dilate(found.astype(np.uint8), np.ones((reach, reach), np.uint8)) > 0
    near &= inside
    bright, out = np.full_like(brightness, np.nan), np.ones_like(brightness)
    in_bands(lambda rows: _bright(brightness, inside, across, near, rows.start, bright[rows]), len(out))
    in_bands(lambda rows: _ratio_to_sides(bright, across, found, rows.start, out[rows]), len(out))
    return out


def hollows(openness: Field) -> Mask:
    """Return where the page stands before itself, (r, c)."""
    return np.asarray(openness < OPEN)


def _directions(light: Field, openness: Field, inside: Mask) -> tuple[Field, Mask]:
    """Return unit vectors across the creases, and where those are.

    The vectors are (r, c, 2) = (right, down).
    """
    xx, xy, yy = _tensor(light)
    turn = np.arctan2(2 * xy, xx - yy) / 2
    anisotropy, total = np.hypot(xx - yy, 2 * xy), xx + yy
    # Where several creases meet, fewer of the changes run across one.
    found = inside & ((total + anisotropy) / 2 > STEP**2) & (anisotropy > MAJORITY * total)
    found = cv2.dilate(found.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    hollow = hollows(openness)
    if hollow.any():
        xx, xy, yy = _tensor(openness)
        turn = np.where(hollow, np.arctan2(2 * xy, xx - yy) / 2, turn)
    return np.dstack([np.cos(turn), np.sin(turn)]), (found | hollow) & inside


def _tensor(field: Field) -> list[Field]:
    """Return the structure tensor of the logarithm of a field.

    The field (r, c) is positive. Returns (xx, xy, yy), each (r, c).
    """
    level = np.log(np.maximum(field, SINGLE_TINY))
    right, down = (cv2.Sobel(level, cv2.CV_32F, *order, ksize=3, scale=1 / 8) for order in ((1, 0), (0, 1)))
    return [np.asarray(cv2.GaussianBlur(part, (0, 0), TENSOR)) for part in (right * right, right * down, down * down)]


@numba.njit(cache=True, nogil=True)
def _bright(brightness: Field, inside: Mask, across: Field, near: Mask, first: int, out: Field) -> None:
    """Write the paper's brightness along a crease, for rows from `first` on, into out."""
    rows, cols = brightness.shape
    brightest = np.empty(ABOVE + 1, np.float32)
    for row in range(first, first + len(out)):
        for col in range(cols):
            if not near[row, col]:
                continue
            x, y = -across[row, col, 1], across[row, col, 0]
            length = np.sqrt(x * x + y * y)
            x, y = x / length, y / length
            count = 0
            brightest[:] = -1.0
            for k in range(-ALONG, ALONG + 1):
                i, j = int(np.rint(row + k * y)), int(np.rint(col + k * x))
                if 0 <= i < rows and 0 <= j < cols and inside[i, j]:
                    value = brightness[i, j]
                    count += 1
                    for n in range(len(brightest)):
                        brightest[n], value = max(brightest[n], value), min(brightest[n], value)
            if count > ALONG:
                out[row - first, col] = brightest[count - 1 - int(BRIGHT * (count - 1))]


@numba.njit(cache=True, nogil=True)
def _ratio_to_sides(bright: Field, across: Field, found: Mask, first: int, out: Field) -> None:
    """Write the ratio of a line to both of its sides.

    For rows from `first` on, into out; 0 is not shading.
    """
    rows, cols = bright.shape
    zero, one = np.float32(0), np.float32(1)
    for row in range(first, first + len(out)):
        for col in range(cols):
            here = bright[row, col]
            if not found[row, col] or not here > 0:
                continue
            least, most = np.float32(np.inf), zero
            for way in FLANKS:
                i, j = int(np.rint(row + way * across[row, col, 1])), int(np.rint(col + way * across[row, col, 0]))
                known = 0 <= i < rows and 0 <= j < cols and bright[i, j] > 0
                side = bright[i, j] if known else zero
                least, most = min(least, side), max(most, side)
            if least > 0:
                over, under = here / most, here / least
                likely = over <= MOST and under >= LEAST
                out[row - first, col] = max(over, one) * min(under, one) if likely else zero
