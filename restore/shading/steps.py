"""Steps of the light across creases, sharp at any resolution.

They are placed by the picture itself. Light computed from facets changes abruptly from one to the next, at a place
known to about a cell. The light on either side of a step is known, so what is left to find is how far the step is
displaced and how wide the camera drew it. Both follow from the bare ground across it, as the maximum of their posterior
density, by Gauss-Newton steps.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numba
import numpy as np
from scipy.special import ndtr, ndtri

from restore.numerics.limits import SINGLE_TINY
from restore.numerics.robust import MAJORITY, SIGNIFICANT, robust_sigma
from restore.runtime.threads import in_bands
from restore.scan import Floats, Ints, Mask
from restore.shading.certainty import CERTAIN
from restore.shading.channels import total_of
from restore.shading.relief import Field

BLUR = 1.0  # cells: steps are drawn so wide before they are sharpened, so that their stairs from cell to cell are gone
CELL = 1 / 12  # cells²: variance of the area of a cell
REACH = 3  # cells to either side, where a step so blurred has ended
VISIBLE = 0.03  # of the light, ΔE 1 to 2: a smaller difference is not seen
NEAREST = 0.25  # of the change: what is nearer to one end of it belongs to that side
FARTHEST = float(ndtri(0.997))  # widths: the blurred light does not resolve longer distances
DISPLACED = 1.0  # cells, standard deviation: half a sample of the range grid, and as much between shape and picture
WIDTH = 0.7  # cells: the standard deviation of a step in the picture, of pixels of half a millimetre and a lens
SPREAD = 0.5  # of its logarithm: a crease may have a radius, a camera more pixels
TRIED = 0.25  # cells: of displacements, a part of the width of a step
UNLIKE = 0.05  # of its contrast: no step is drawn as a Gaussian's integral
ALONG = 6  # cells to either side, 2.5 mm: a crease is straight over that length
ROUNDS = 4  # of Gauss and Newton
SPARED = 7  # every seventh cell suffices for the noise


@dataclass(frozen=True, eq=False)
class Steps:
    """A light and its steps, by cells.

    light: (r, c, 3), the light with its steps blurred.
    contrast: (r, c, 3), the light on the bright side of a step less that on its dark side, 0 away from steps.
    place: (r, c), distance from the step towards the bright side, in widths of the blurred step.
    shift, width: (r, c) cells, how far the step is displaced to the bright side, and its standard deviation.
    found: (r, c), where a step is within REACH.
    """

    light: Field
    contrast: Field
    place: Field
    shift: Field
    width: Field
    found: Mask

    def distance(self, variance: float = 0.0) -> Field:
        """Return the distance (r, c) from the displaced step, in its widths.

        variance: cells², less than what cells show.
        """
        width = np.sqrt(np.maximum(self.width**2 - np.float32(variance), np.float32(CELL)))
        return np.asarray((np.float32(BLUR) * self.place - self.shift) / width)

    @cached_property
    def sharp(self) -> Field:
        """Return the light (r, c, 3), averaged over cells, its steps as the camera drew them."""
        light, distance = self.light.copy(), self.distance()[self.found]
        rise = (ndtr(distance) - ndtr(self.place[self.found])).astype(np.float32)
        light[self.found] += self.contrast[self.found] * rise[:, None]
        return light


def find_steps(light: Field, inside: Mask) -> Steps:
    """Steps of a light (r, c, 3), known on all cells, within a page (r, c)."""
    total, blurred = total_of(light), cv2.GaussianBlur(light, (0, 0), BLUR)
    side = 2 * REACH + 1
    change, abrupt = _range(total, side), cv2.dilate(_range(total, 3), np.ones((side - 2, side - 2), np.uint8))
    # Of a step, most of the change comes within two cells; in a constant gradient a third does.
    some = inside & (change > VISIBLE * total) & (abrupt > MAJORITY * change)
    contrast, place = np.zeros_like(light), np.zeros_like(total)
    level = total_of(blurred)
    in_bands(lambda rows: _sides(light, total, level, some, rows.start, contrast[rows], place[rows]), len(total))
    found = place > 0
    place[found] = np.clip(ndtri(place[found]), -FARTHEST, FARTHEST)
    return Steps(blurred, contrast, place, np.zeros_like(total), np.full_like(total, WIDTH), found)


def _range(field: Field, side: int) -> Field:
    window = np.ones((side, side), np.uint8)
    return np.asarray(cv2.dilate(field, window) - cv2.erode(field, window))


def place_steps(steps: Steps, ratio: Field, ground: Mask) -> Steps:
    """The steps where, and as wide as, the ground shows them.

    ratio (r, c): brightness of the page, in units of what the ground shows in a light of 1; ground (r, c): where it is.
    """
    at = np.flatnonzero(steps.found & _between(ground, steps))
    plain = np.flatnonzero(ground & ~steps.found)[::SPARED]
    if not len(at) or not len(plain):
        return steps
    level = total_of(steps.light)
    noise = max(robust_sigma(_of(ratio, plain) / _of(level, plain) - 1), SINGLE_TINY)
    blurred, contrast, place, seen = (_of(field, at) for field in (level, total_of(steps.contrast), steps.place, ratio))
    shown = _Shown(at, level.shape[1], blurred, contrast, place, seen, np.hypot(noise, UNLIKE * contrast / blurred))
    unknowns = shown.solved()
    shift, width = np.zeros_like(steps.shift), np.full_like(steps.width, WIDTH)
    shift.ravel()[at], width.ravel()[at] = unknowns[0], WIDTH * np.exp(unknowns[1])
    return replace(steps, shift=shift, width=width)


def _of(field: Field, at: Ints) -> Field:
    return np.asarray(field.ravel()[at])


def _between(ground: Mask, steps: Steps) -> Mask:
    """Return where ground is near on both sides of a step, (r, c)."""
    near = np.ones((2 * ALONG + 1, 2 * ALONG + 1), np.uint8)
    sides = (ground & steps.found & side for side in (steps.place > 0, steps.place < 0))
    return np.asarray(np.minimum(*(cv2.dilate(side.astype(np.uint8), near) for side in sides)) > 0)


@dataclass(frozen=True, eq=False)
class _Shown:
    """What the page shows in cells next to steps.

    at: (n,), those cells, with blurred light, contrast, place, brightness, noise.
    """

    at: Ints
    cols: int
    blurred: Field
    contrast: Field
    place: Field
    seen: Field
    noise: Field

    def light(self, shift: Floats | float, spread: Floats | float) -> tuple[Floats, Floats]:
        """Return the light (n,) of displaced steps, and the distances from them.

        The distances are in their widths.
        """
        distance = (BLUR * self.place - shift) / (WIDTH * np.exp(spread))
        return self.blurred + self.contrast * (ndtr(distance) - ndtr(self.place)), distance

    def nearest(self) -> Floats:
        """Return the displacement (2, n), of some, that leaves least.

        What no light explains, such as ink, counts the same for all of them.
        """
        best, least = np.zeros((2, len(self.at))), np.full(len(self.at), np.inf)
        for shift in np.arange(-CERTAIN, CERTAIN + TRIED, TRIED) * DISPLACED:
            light, _ = self.light(shift, 0.0)
            rest = np.minimum(np.abs(self.seen / light - 1) / self.noise, SIGNIFICANT)
            cost = self.summed(rest * rest) + (shift / DISPLACED) ** 2
            best[0], least = np.where(cost < least, shift, best[0]), np.minimum(cost, least)
        return best

    def solved(self) -> Floats:
        """Return displacement and log width of steps, (2, n).

        The logarithm is of the width over WIDTH. They maximise their posterior density, if they are alike within ALONG.
        """
        unknowns = self.nearest()
        for _ in range(ROUNDS):
            unknowns = self._step(unknowns)
        return unknowns

    def _step(self, unknowns: Floats) -> Floats:
        """Return the linearised solution (2, n) from the unknowns of the step before."""
        shift, spread = unknowns
        light, distance = self.light(shift, spread)
        rest = self.seen / light - 1
        slope = -self.contrast * np.exp(-distance * distance / 2) / np.sqrt(2 * np.pi) / light / self.noise
        slope *= np.abs(rest) < SIGNIFICANT * self.noise
        by_shift, by_spread = slope / (WIDTH * np.exp(spread)), slope * distance
        rest = rest / self.noise + by_shift * shift + by_spread * spread
        one, other = (
            self.summed(by * by) + 1 / deviation**2
            for by, deviation in zip((by_shift, by_spread), (DISPLACED, SPREAD), strict=True)
        )
        both, left, right = (self.summed(by) for by in (by_shift * by_spread, by_shift * rest, by_spread * rest))
        determinant = one * other - both * both
        solved = (other * left - both * right) / determinant, (one * right - both * left) / determinant
        most = CERTAIN * np.array([[DISPLACED], [SPREAD]])
        return np.asarray(np.clip(np.stack(solved), -most, most))

    def summed(self, values: Floats) -> Floats:
        """Return sums (n,) of values (n,) over the neighbours within ALONG."""
        (row, col), side = self._within, 2 * ALONG + 1
        field = np.zeros((row.max() + 1, col.max() + 1), np.float32)
        field[row, col] = values
        sums = cv2.boxFilter(field, -1, (side, side), normalize=False, borderType=cv2.BORDER_CONSTANT)
        return np.asarray(sums[row, col])

    @cached_property
    def _within(self) -> tuple[Ints, Ints]:
        """Rows and columns (n,) of the cells, from the first of both on."""
        row, col = np.divmod(self.at, self.cols)
        return row - row.min(), col - col.min()


@numba.njit(cache=True, nogil=True)
def _sides(light: Field, total: Field, blurred: Field, some: Mask, first: int, contrast: Field, place: Field) -> None:
    """Write the contrast of steps, and how far the light has risen.

    For rows from `first` on: the contrast (n, c, 3), and the fraction of it that the blurred light has risen by (n, c),
    where `some`.
    """
    sums, counts = np.empty((2, 3)), np.empty(2)
    for row in range(first, first + len(place)):
        for col in range(total.shape[1]):
            if not some[row, col]:
                continue
            window = total[max(row - REACH, 0) : row + REACH + 1, max(col - REACH, 0) : col + REACH + 1]
            colours = light[max(row - REACH, 0) : row + REACH + 1, max(col - REACH, 0) : col + REACH + 1]
            least, most = np.float32(np.inf), np.float32(-np.inf)
            for i in range(window.shape[0]):
                for j in range(window.shape[1]):
                    least, most = min(least, window[i, j]), max(most, window[i, j])
            near = NEAREST * (most - least)
            sums[:], counts[:] = 0, 0
            for i in range(window.shape[0]):
                for j in range(window.shape[1]):
                    side = 0 if window[i, j] < least + near else 1 if window[i, j] > most - near else -1
                    if side >= 0:
                        counts[side] += 1
                        for k in range(3):
                            sums[side, k] += colours[i, j, k]
            rise, floor = 0.0, 0.0
            for k in range(3):
                dark = sums[0, k] / counts[0]
                contrast[row - first, col, k] = sums[1, k] / counts[1] - dark
                rise += contrast[row - first, col, k]
                floor += dark
            place[row - first, col] = min(max((blurred[row, col] - floor) / rise, SINGLE_TINY), 1 - SINGLE_TINY)
