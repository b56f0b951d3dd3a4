"""Fits a surface over the tangent plane of a window.

It is needed where the surface bends too fast for a quadratic over the grid. Towards the spine of a book, depth as a
function of the column gets ever steeper, and no cubic follows it; yet the wall itself bends evenly, and over its own
tangent plane it is close to a quadratic.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from restore.camera.rays import STEEP
from restore.range_image.facets.quadratic_fit import MAX_LEVERAGE, MIN_SAMPLES, POWERS, SINGULAR
from restore.runtime.threads import in_bands
from restore.scan import Floats, Ints, Mask

ALL_POWERS = (*POWERS, (3, 0), (2, 1), (1, 2), (0, 3))  # of the places on the plane: a cubic's ten terms
QUADRATIC, CUBIC = len(POWERS), len(ALL_POWERS)  # terms
MAX_BEND = 16.0  # standard deviations of the samples: rise of the quadratic, beyond which cubic terms matter
BY_CHANCE = 6.0  # F of four more terms and 39 degrees of freedom: noise alone exceeds it once in 1,400 windows
ROUNDS = 4  # of Newton's method, from the tangent plane to the surface
FIELDS = 4  # value, slope per column, slope per row, variance


def fit_over_tangents(
    data: Floats, weight: Floats, wanted: Mask, terms: Floats, centres: Ints, steep: float, radius: int
) -> Floats:
    """Fit every wanted sample over the tangent plane of its window.

    The fit is a quadratic, and where that rises too far or misses too much, a cubic.
    data, weight: (rows, cols).
    terms: (rows, cols, 6), wide quadratics, whose tangent planes are taken.
    centres: (rows, cols), flat index of the sample whose window each takes.
    steep: slope, per column, of 45°.
    Returns (rows, cols, FIELDS), NaN elsewhere, and where a window does not determine a fit.
    """
    facets = np.empty((*data.shape, FIELDS))

    def fit_band(rows: slice) -> None:
        _fit_rows(data, weight, wanted, terms, centres, steep, radius, rows.start, rows.stop, facets, _scratch())

    in_bands(fit_band, len(data))
    return facets


class Window(NamedTuple):
    """What is fitted to one window, in t = CUBIC terms in the order of ALL_POWERS.

    axes     (3, 3) two directions on the tangent plane and its normal, in columns, rows and depth.
    normal   (t · (t + 1) / 2,) the normal matrix, packed; right (t,) the right side; basis (t,) terms at one place.
    factor   (t, t) the Cholesky factor, whose diagonal holds the reciprocals of its own entries: to divide takes as
             long as ten products. solution (t,): what its triangle makes of the right side.
    surface  (t,) the coefficients.
    variance (2,) about a cubic, and about a quadratic.
    """

    axes: Floats
    normal: Floats
    right: Floats
    basis: Floats
    factor: Floats
    solution: Floats
    surface: Floats
    variance: Floats


def _scratch() -> Window:
    right, solution, surface = np.empty((3, CUBIC))
    normal, basis, factor = np.empty(CUBIC * (CUBIC + 1) // 2), np.ones(CUBIC), np.zeros((CUBIC, CUBIC))
    return Window(np.empty((3, 3)), normal, right, basis, factor, solution, surface, np.empty(2))


@numba.njit(cache=True, nogil=True)
def _fit_rows(
    data: Floats, weight: Floats, wanted: Mask, terms: Floats, centres: Ints, steep: float, radius: int,
    first: int, end: int, facets: Floats, window: Window,
) -> None:  # fmt: skip
    """Write the facets of the rows from first to end."""
    cols = data.shape[1]
    for r in range(first, end):
        for c in range(cols):
            for k in range(FIELDS):
                facets[r, c, k] = np.nan
            i, j = centres[r, c] // cols, centres[r, c] % cols
            if not wanted[r, c] or np.isnan(terms[i, j, 0]):
                continue
            level = terms[i, j, 0]
            _set_axes(terms[i, j, 1] / steep, terms[i, j, 2] / steep, radius, window.axes)
            count, square = _set_moments(data, weight, i, j, radius, level, steep, window)
            number = _solve(count, square, window)
            while number > 0:  # without the cubic terms where the surface with them turns too far
                _substitute_back(number, window)
                height, across, down = _on_line_of_sight(c - j, r - i, window.axes, window.surface)
                if not np.isnan(height):
                    facets[r, c, 0] = level + steep * height
                    facets[r, c, 1], facets[r, c, 2] = steep * across, steep * down
                    variance = window.variance[0 if number == CUBIC else 1]
                    facets[r, c, 3] = variance * (steep / window.axes[2, 2]) ** 2
                    break
                number = QUADRATIC if number == CUBIC else 0


@numba.njit(cache=True, nogil=True, inline="always")
def _set_axes(across: float, down: float, radius: int, axes: Floats) -> None:
    """Write two directions on the plane of slopes and its normal: columns, rows, depth.

    They are those of the grid, turned to the plane, and in units of the window's reach on it.
    """
    z = 1.0 / np.sqrt(1.0 + across * across + down * down)
    x, y, unit = -across * z, -down * z, z / radius
    axes[0, 0], axes[0, 1], axes[0, 2] = (1.0 - x * x / (1.0 + z)) * unit, -x * y / (1.0 + z) * unit, -x * unit
    axes[1, 0], axes[1, 1], axes[1, 2] = -x * y / (1.0 + z) * unit, (1.0 - y * y / (1.0 + z)) * unit, -y * unit
    axes[2, 0], axes[2, 1], axes[2, 2] = x * unit, y * unit, z * unit


@numba.njit(cache=True, nogil=True, inline="always")
def _turned(col: float, row: float, depth: float, axes: Floats) -> tuple[float, float, float]:
    """A place along the axes: two coordinates on the plane, and the height over it."""
    return (
        axes[0, 0] * col + axes[0, 1] * row + axes[0, 2] * depth,
        axes[1, 0] * col + axes[1, 1] * row + axes[1, 2] * depth,
        axes[2, 0] * col + axes[2, 1] * row + axes[2, 2] * depth,
    )


@numba.njit(cache=True, nogil=True)
def _set_moments(
    data: Floats, weight: Floats, i: int, j: int, radius: int, level: float, steep: float, window: Window
) -> tuple[int, float]:
    """Write the packed normal matrix and the right side of a window.

    Returns the number of its samples, and their sum of squares.
    """
    normal, right, basis = window.normal, window.right, window.basis
    for k in range(len(normal)):
        normal[k] = 0.0
    for k in range(CUBIC):
        right[k] = 0.0
    count, square = 0, 0.0
    for m in range(max(0, i - radius), min(data.shape[0], i + radius + 1)):
        for n in range(max(0, j - radius), min(data.shape[1], j + radius + 1)):
            if weight[m, n] <= 0.0:
                continue
            a, b, height = _turned(n - j, m - i, (data[m, n] - level) / steep, window.axes)
            basis[1], basis[2] = a, b
            basis[3], basis[4], basis[5] = a * a, a * b, b * b
            basis[6], basis[7], basis[8], basis[9] = a * a * a, a * a * b, a * b * b, b * b * b
            k = 0
            for p in range(CUBIC):
                weighted = weight[m, n] * basis[p]
                right[p] += weighted * height
                for q in range(p + 1):
                    normal[k] += weighted * basis[q]
                    k += 1
            square += weight[m, n] * height * height
            count += 1
    return count, square


@numba.njit(cache=True, nogil=True)
def _solve(count: int, square: float, window: Window) -> int:
    """Write the factor, what its triangle makes of the right side, and the variances.

    Returns how many terms the surface needs, 0 where the samples determine none.
    """
    normal, factor, solution = window.normal, window.factor, window.solution
    terms = CUBIC
    if not (count >= 2 * CUBIC and _cholesky(normal, factor, CUBIC)):
        terms = QUADRATIC
        if count < MIN_SAMPLES or not _cholesky(normal, factor, QUADRATIC):
            return 0
    unit, leverage, explained, of_quadratic = window.surface, 0.0, 0.0, 0.0
    gain = 0.0
    for p in range(terms):
        entry, trace = window.right[p], 1.0 if p == 0 else 0.0
        for q in range(p):
            entry -= factor[p, q] * solution[q]
            trace -= factor[p, q] * unit[q]
        solution[p], unit[p] = entry * factor[p, p], trace * factor[p, p]
        leverage += unit[p] * unit[p] * normal[0]
        if p < QUADRATIC:
            explained, of_quadratic = explained + solution[p] * solution[p], leverage
        else:
            gain += solution[p] * solution[p]
    left = max(square - explained, 0.0)
    variance = left / (count - QUADRATIC)
    window.variance[1] = variance
    if of_quadratic > MAX_LEVERAGE * count:
        return 0
    if terms == QUADRATIC or leverage > MAX_LEVERAGE * count:
        return QUADRATIC
    _substitute_back(QUADRATIC, window)
    rise = abs(window.surface[3]) + abs(window.surface[4]) + abs(window.surface[5])
    rest = max(left - gain, 0.0) / (count - CUBIC)
    window.variance[0] = rest
    rises, misses = rise * rise > MAX_BEND * MAX_BEND * variance, gain > (CUBIC - QUADRATIC) * BY_CHANCE * rest
    return CUBIC if rises or misses else QUADRATIC


@numba.njit(cache=True, nogil=True)
def _cholesky(packed: Floats, factor: Floats, terms: int) -> bool:
    """Factor a packed symmetric matrix (t, t) in place.

    Returns False when the samples do not determine the terms.
    """
    k = 0
    for i in range(terms):
        for j in range(i + 1):
            entry = packed[k]
            k += 1
            for m in range(j):
                entry -= factor[i, m] * factor[j, m]
            if i > j:
                factor[i, j] = entry * factor[j, j]
            elif entry > SINGULAR * packed[0]:
                factor[i, i] = 1.0 / np.sqrt(entry)
            else:
                return False
    return True


@numba.njit(cache=True, nogil=True)
def _substitute_back(terms: int, window: Window) -> None:
    """Write the coefficients of `terms` terms, 0 for the others.

    They come from the forward substitution with the factor.
    """
    factor, surface = window.factor, window.surface
    for p in range(CUBIC - 1, -1, -1):
        entry = window.solution[p] if p < terms else 0.0
        for q in range(p + 1, terms):
            entry -= factor[q, p] * surface[q]
        surface[p] = entry * factor[p, p] if p < terms else 0.0


@numba.njit(cache=True, nogil=True, inline="always")
def _on_line_of_sight(col: int, row: int, axes: Floats, s: Floats) -> tuple[float, float, float]:
    """Return depth on a line of sight, and its change per column and row.

    By Newton's method on the height over the plane, whose slopes in (col, row, depth) are those of the surface; NaN
    where it turns by more than 45° from the plane: that is two sides, or extrapolated too far.
    s: (CUBIC,), the surface.
    """
    depth = -(axes[2, 0] * col + axes[2, 1] * row) / axes[2, 2]
    by_col, by_row, by_depth = axes[2, 0], axes[2, 1], axes[2, 2]
    for _ in range(ROUNDS):
        a, b, over = _turned(col, row, depth, axes)
        height = s[0] + s[1] * a + s[2] * b + s[3] * a * a + s[4] * a * b + s[5] * b * b
        height += s[6] * a * a * a + s[7] * a * a * b + s[8] * a * b * b + s[9] * b * b * b
        along_a = s[1] + 2 * s[3] * a + s[4] * b + 3 * s[6] * a * a + 2 * s[7] * a * b + s[8] * b * b
        along_b = s[2] + s[4] * a + 2 * s[5] * b + s[7] * a * a + 2 * s[8] * a * b + 3 * s[9] * b * b
        by_col = axes[2, 0] - along_a * axes[0, 0] - along_b * axes[1, 0]
        by_row = axes[2, 1] - along_a * axes[0, 1] - along_b * axes[1, 1]
        by_depth = axes[2, 2] - along_a * axes[0, 2] - along_b * axes[1, 2]
        if by_depth <= 0.0 or along_a * along_a + along_b * along_b > STEEP * STEEP:
            return np.nan, np.nan, np.nan
        depth -= (over - height) / by_depth
    return depth, -by_col / by_depth, -by_row / by_depth
