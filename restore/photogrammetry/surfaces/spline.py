"""Bicubic splines with values in space, and their normal equations.

Points, bending and strain contribute to the equations. Coefficients (rows, cols, 3) are numbered along the shorter
side, so that the band of the normal equations is narrow. Of the band, (count, width), the entry (i, j) of the matrix
with i ≥ j is at (j, i − j). Right sides are those of a step of the coefficients.
"""

from __future__ import annotations

import numba
import numpy as np

from restore.scan import Floats, Ints

BORDER = 2  # knots beyond the rectangle on every side
TINY_WEIGHT = 1e-6  # of what nothing else determines
# Of the largest weight of a bending, on the diagonal: without, the rounding of what a very stiff sheet resists may
# leave no positive pivot for what it does not. Steps are damped, the end is not moved.
DAMPING = 1e-12


def numbering(rows: int, cols: int, *, along_rows: bool = False) -> tuple[int, int, int]:
    """Return the numbering steps of coefficients, and the band's width.

    The steps are between neighbouring rows and neighbouring columns. Each coefficient has three numbers from three
    times its own on.
    along_rows: whether they are numbered so, whichever side is shorter.
    """
    by_row, by_col = (cols, 1) if cols <= rows or along_rows else (1, rows)
    return by_row, by_col, 9 * max(by_row, by_col) + 12


@numba.njit(cache=True)
def _basis(t: float, step: float, order: int, out: Floats) -> None:
    """Write the four cubic B-splines, or derivatives, at a fraction t of an interval."""
    if order == 0:
        out[0], out[1] = (1 - t) ** 3 / 6, (3 * t**3 - 6 * t**2 + 4) / 6
        out[2], out[3] = (-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6, t**3 / 6
    elif order == 1:
        out[0], out[1] = -((1 - t) ** 2) / 2 / step, (3 * t**2 - 4 * t) / 2 / step
        out[2], out[3] = (-3 * t**2 + 2 * t + 1) / 2 / step, t**2 / 2 / step
    else:
        out[0], out[1], out[2], out[3] = (1 - t) / step**2, (3 * t - 2) / step**2, (1 - 3 * t) / step**2, t / step**2


@numba.njit(cache=True)
def _cell(place: float, low: float, step: float, count: int) -> tuple[int, float]:
    """Return the first of four coefficients that determine a place.

    Returns also the place's fraction of the interval.
    """
    scaled = (place - low) / step
    cell = min(max(int(np.floor(scaled)), 1), count - 3)
    return cell - 1, scaled - cell


@numba.njit(cache=True, nogil=True)
def evaluate(places: Floats, low: Floats, step: float, coefficients: Floats, order: int) -> Floats:
    """Return values at places (n, 2), and derivatives up to an order.

    First order by u and v, second by uu, uv and vv. Returns (n, k, 3).
    """
    orders = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    count = 1 if order == 0 else (3 if order == 1 else 6)
    rows, cols, _ = coefficients.shape
    out = np.zeros((len(places), count, 3))
    across, down = np.empty((3, 4)), np.empty((3, 4))
    for n in range(len(places)):
        col, s = _cell(places[n, 0], low[0], step, cols)
        row, t = _cell(places[n, 1], low[1], step, rows)
        for o in range(order + 1):
            _basis(s, step, o, across[o])
            _basis(t, step, o, down[o])
        for k in range(count):
            a, b = orders[k]
            for i in range(4):
                for j in range(4):
                    weight = down[b, i] * across[a, j]
                    for d in range(3):
                        out[n, k, d] += weight * coefficients[row + i, col + j, d]
    return out


@numba.njit(cache=True, nogil=True)
def add_points(
    band: Floats, side: Floats, places: Floats, points: Floats, normals: Floats, weights: Floats, sliding: float,
    low: Floats, step: float, coefficients: Floats, by_row: int, by_col: int,
) -> None:  # fmt: skip
    """Add points (n, 3) at places (n, 2) to the equations.

    weights: (n,), along normals (n, 3), `sliding` times as much across them.
    """
    rows, cols, _ = coefficients.shape
    across, down, form, off, pull = np.empty(4), np.empty(4), np.empty((3, 3)), np.empty(3), np.empty(3)
    factor, number = np.empty(16), np.empty(16, np.int64)
    for n in range(len(places)):
        col, s = _cell(places[n, 0], low[0], step, cols)
        row, t = _cell(places[n, 1], low[1], step, rows)
        _basis(s, step, 0, across)
        _basis(t, step, 0, down)
        off[:] = points[n]
        for i in range(4):
            for j in range(4):
                factor[4 * i + j] = down[i] * across[j]
                number[4 * i + j] = 3 * ((row + i) * by_row + (col + j) * by_col)
                for d in range(3):
                    off[d] -= factor[4 * i + j] * coefficients[row + i, col + j, d]
        for d in range(3):
            for e in range(3):
                form[d, e] = weights[n] * (1.0 - sliding) * normals[n, d] * normals[n, e]
            form[d, d] += weights[n] * sliding
        for d in range(3):
            pull[d] = form[d, 0] * off[0] + form[d, 1] * off[1] + form[d, 2] * off[2]
        for a in range(16):
            for d in range(3):
                side[number[a] + d] += factor[a] * pull[d]
            for b in range(a + 1):
                product = factor[a] * factor[b]
                high, first = max(number[a], number[b]), min(number[a], number[b])
                for d in range(3):
                    for e in range(3 if b < a else d + 1):
                        band[first + e, high + d - first - e] += product * form[d, e]


@numba.njit(cache=True, nogil=True)
def add_strain(
    band: Floats, side: Floats, coefficients: Floats, step: float, stiffness: float, most: float, by_row: int,
    by_col: int,
) -> None:  # fmt: skip
    """Add the strain in the centre of each cell to the equations.

    It is (|Su|² − 1)/2, (|Sv|² − 1)/2 and Su·Sv, which is twice the shear.
    coefficients: (rows, cols, 3).
    most: strain at which a cell resists half as much, and less beyond.
    """
    rows, cols, _ = coefficients.shape
    value, slope = np.empty(4), np.empty(4)
    _basis(0.5, step, 0, value)
    _basis(0.5, step, 1, slope)
    su, sv, misfit = np.empty(3), np.empty(3), np.empty(3)
    by, number = np.empty((3, 48)), np.empty(48, np.int64)
    for row in range(rows - 3):
        for col in range(cols - 3):
            su[:], sv[:] = 0.0, 0.0
            for i in range(4):
                for j in range(4):
                    for d in range(3):
                        su[d] += value[i] * slope[j] * coefficients[row + i, col + j, d]
                        sv[d] += slope[i] * value[j] * coefficients[row + i, col + j, d]
            misfit[0] = 0.5 * (1.0 - (su * su).sum())
            misfit[1] = 0.5 * (1.0 - (sv * sv).sum())
            misfit[2] = -(su * sv).sum() / np.sqrt(2.0)
            weight = stiffness / (1.0 + (misfit * misfit).sum() / most**2)
            for i in range(4):
                for j in range(4):
                    u, v = value[i] * slope[j], slope[i] * value[j]
                    for d in range(3):
                        k = 3 * (4 * i + j) + d
                        number[k] = 3 * ((row + i) * by_row + (col + j) * by_col) + d
                        by[0, k], by[1, k] = u * su[d], v * sv[d]
                        by[2, k] = (u * sv[d] + v * su[d]) / np.sqrt(2.0)
            for a in range(48):
                for m in range(3):
                    side[number[a]] += weight * by[m, a] * misfit[m]
                for b in range(a + 1):
                    high, first = max(number[a], number[b]), min(number[a], number[b])
                    product = by[0, a] * by[0, b] + by[1, a] * by[1, b] + by[2, a] * by[2, b]
                    band[first, high - first] += weight * product


@numba.njit(cache=True)
def _add_difference(band: Floats, side: Floats, values: Floats, at: Ints, kernel: Floats, weight: float) -> None:
    """Add a weighted combination of coefficients that is to be zero.

    at: numbers of the coefficients.
    values: (k, 3), theirs.
    """
    for d in range(3):
        total = (kernel * values[:, d]).sum()
        for a in range(len(at)):
            side[3 * at[a] + d] -= weight * kernel[a] * total
            for b in range(a + 1):
                high, first = max(at[a], at[b]), min(at[a], at[b])
                band[3 * first + d, 3 * (high - first)] += weight * kernel[a] * kernel[b]


@numba.njit(cache=True, nogil=True)
def add_bending(
    band: Floats, side: Floats, coefficients: Floats, weight: float, along: float, by_row: int, by_col: int
) -> None:
    """Add the squared third differences of coefficients (rows, cols, 3).

    They are the change of curvature, times a step to the fourth, that of Duchon's splines of third order (1977). What
    is prolonged keeps its curvature. With `along` above 1, for a sheet ruled along v and numbered along rows, the
    differences that such a sheet does not have weigh `along` times as much, and by u the fourth ones take the place of
    the third: what is prolonged across the rulings goes on changing its curvature.
    """
    rows, cols, _ = coefficients.shape
    third, mixed = np.array([1.0, -3.0, 3.0, -1.0]), np.array([1.0, -2.0, 1.0, -1.0, 2.0, -1.0])
    fourth, ruled = np.array([1.0, -4.0, 6.0, -4.0, 1.0]), along > 1.0
    shapes = ((1, 4), (4, 1), (2, 3), (3, 2))
    for row in range(rows):
        for col in range(cols):
            here = row * by_row + col * by_col
            for height, width in shapes:
                if row + height > rows or col + width > cols or (ruled and height == 1):
                    continue
                values, at = np.empty((height * width, 3)), np.empty(height * width, np.int64)
                for i in range(height):
                    for j in range(width):
                        # the longer side of a shape runs first in its kernel
                        k = i * width + j if width > height else j * height + i
                        values[k], at[k] = coefficients[row + i, col + j], here + i * by_row + j * by_col
                if height * width == 4:
                    _add_difference(band, side, values, at, third, along * weight)
                else:
                    _add_difference(band, side, values, at, mixed, 3.0 * along * weight)
            if ruled and col + 5 <= cols:
                at = here + by_col * np.arange(5)
                _add_difference(band, side, coefficients[row, col : col + 5], at, fourth, weight)
            for d in range(3):
                band[3 * here + d, 0] += TINY_WEIGHT + DAMPING * along * weight


@numba.njit(cache=True, nogil=True, fastmath=True)
def solve(band: Floats, side: Floats) -> None:
    """Replace the right side (count,) by the solution.

    And the band (count, width) by its Cholesky factor. Four columns are eliminated at a time, so that the rest of the
    band is read and written a fourth as often. Compiled here: LAPACK's threads wait for each other longer than a band
    of this width takes one of them.
    """
    count, width = band.shape
    for first in range(0, count, 4):
        last = min(first + 4, count)
        for j in range(first, last):
            _scale_column(band, side, j)
            for row in range(j + 1, min(last, j + width)):
                factor = band[j, row - j]
                for m in range(min(width, count - j) - row + j):
                    band[row, m] -= factor * band[j, row - j + m]
        if last - first == 4:
            _eliminate_four(band, first)
    for j in range(count - 1, -1, -1):
        total = side[j]
        for k in range(1, min(width, count - j)):
            total -= band[j, k] * side[j + k]
        side[j] = total / band[j, 0]


@numba.njit(cache=True, nogil=True, fastmath=True)
def _scale_column(band: Floats, side: Floats, j: int) -> None:
    """Scale a column of the factor by its pivot, and update the right side.

    It is divided by the root of its pivot, and subtracted from the right side.
    """
    count, width = band.shape
    # No exact pivot is less than the TINY_WEIGHT that is on the diagonal: what is less is rounding.
    band[j, 0] = max(band[j, 0], TINY_WEIGHT)
    pivot = 1.0 / np.sqrt(band[j, 0])
    side[j] *= pivot
    for k in range(min(width, count - j)):
        band[j, k] *= pivot
    for k in range(1, min(width, count - j)):
        side[j + k] -= band[j, k] * side[j]


@numba.njit(cache=True, nogil=True, fastmath=True)
def _eliminate_four(band: Floats, j: int) -> None:
    """Subtract the products of four columns, from j on, from later ones."""
    count, width = band.shape
    a, b, c, d = band[j], band[j + 1], band[j + 2], band[j + 3]
    for row in range(j + 4, min(j + width + 3, count)):
        k = row - j
        common = min(j + width, count) - row  # entries of the row that all four columns reach
        if common > 0:
            out = band[row, :common]
            fa, fb, fc, fd = a[k], b[k - 1], c[k - 2], d[k - 3]
            va, vb, vc, vd = a[k:], b[k - 1 :], c[k - 2 :], d[k - 3 :]
            for m in range(common):
                out[m] -= fa * va[m] + fb * vb[m] + fc * vc[m] + fd * vd[m]
        for late in range(1, 4):
            at = k - late
            for m in range(max(common, 0), min(j + late + width, count) - row):
                band[row, m] -= band[j + late, at] * band[j + late, at + m]
