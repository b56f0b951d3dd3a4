"""Fit a surface over the tangent plane of a window, where it bends too fast for a quadratic over the grid.

Towards the spine of a book, depth as a function of the column gets ever steeper, and no cubic follows it; yet the wall
itself bends evenly, and over its own tangent plane it is close to a quadratic.
"""

from __future__ import annotations

import numba
import numpy as np

from restore.range_image.facets.quadratic_fit import MAX_LEVERAGE, MIN_SAMPLES, POWERS, SINGULAR
from restore.runtime.threads import in_bands
from restore.scan import Floats, Ints, Mask

Powers = tuple[tuple[int, int], ...]
ALL_POWERS = (*POWERS, (3, 0), (2, 1), (1, 2), (0, 3))  # of the places on the plane: a cubic's ten terms
QUADRATIC, CUBIC = len(POWERS), len(ALL_POWERS)  # terms
MAX_BEND = 16.0  # standard deviations of the samples: rise of the quadratic, beyond which cubic terms matter
BY_CHANCE = 6.0  # F of four more terms and 39 degrees of freedom: noise alone exceeds it once in 1,400 windows
ROUNDS = 4  # of Newton's method, from the tangent plane to the surface
MAX_TURN = 1.0  # slope over the plane, 45°: what turns by more within a window is two sides, or extrapolated too far
FIELDS = 4  # value, slope per column, slope per row, variance


def fit_over_tangents(
    data: Floats, weight: Floats, wanted: Mask, terms: Floats, centres: Ints, steep: float, radius: int
) -> Floats:
    """(rows, cols, FIELDS) at every wanted sample, NaN elsewhere, and where its window does not determine a fit.

    data, weight (rows, cols) and terms (rows, cols, 6) are those of wide quadratics, whose tangent planes are taken;
    centres (rows, cols) the flat index of the sample whose window each takes; steep the slope, per column, of 45°. The
    fit is a quadratic, and where that rises too far or misses too much, a cubic.
    """
    facets = np.empty((*data.shape, FIELDS))

    def fit_band(rows: slice) -> None:
        _fit_rows(data, weight, wanted, terms, centres, steep, radius, rows.start, rows.stop, facets)

    in_bands(fit_band, len(data))
    return facets


@numba.njit(cache=True, nogil=True)
def _fit_rows(
    data: Floats, weight: Floats, wanted: Mask, terms: Floats, centres: Ints, steep: float, radius: int,
    first: int, end: int, facets: Floats,
) -> None:  # fmt: skip
    """Write the facets of the rows from first to end."""
    cols = data.shape[1]
    facets[first:end] = np.nan
    normal, right = np.empty(CUBIC * (CUBIC + 1) // 2), np.empty(CUBIC)
    factor, solution, surface = np.zeros((CUBIC, CUBIC)), np.empty(CUBIC), np.empty(CUBIC)
    for r in range(first, end):
        for c in range(cols):
            i, j = centres[r, c] // cols, centres[r, c] % cols
            if not wanted[r, c] or np.isnan(terms[i, j, 0]):
                continue
            level, axes = terms[i, j, 0], _tangent_axes(terms[i, j, 1] / steep, terms[i, j, 2] / steep, radius)
            count, square = _moments(data, weight, i, j, radius, level, steep, axes, normal, right)
            most, variances = _solve(normal, right, count, square, factor, solution, surface)
            for number, variance in zip((CUBIC, QUADRATIC), variances):  # noqa: B905 (compiled)
                if number > most:
                    continue
                _substitute_back(factor, solution, number, surface)
                height, across, down = _on_line_of_sight(c - j, r - i, axes, surface)
                if not np.isnan(height):
                    facets[r, c, 0] = level + steep * height
                    facets[r, c, 1], facets[r, c, 2] = steep * across, steep * down
                    facets[r, c, 3] = variance * (steep / axes[2, 2]) ** 2
                    break


@numba.njit(cache=True, nogil=True)
def _tangent_axes(across: float, down: float, radius: int) -> Floats:
    """(3, 3) two directions on the plane of these slopes and its normal, in columns, rows and depth.

    They are those of the grid, turned to the plane, and in units of the window's reach on it.
    """
    z = 1.0 / np.sqrt(1.0 + across * across + down * down)
    x, y = -across * z, -down * z
    axes = np.empty((3, 3))
    axes[0, 0], axes[0, 1], axes[0, 2] = 1.0 - x * x / (1.0 + z), -x * y / (1.0 + z), -x
    axes[1, 0], axes[1, 1], axes[1, 2] = -x * y / (1.0 + z), 1.0 - y * y / (1.0 + z), -y
    axes[2, 0], axes[2, 1], axes[2, 2] = x, y, z
    return axes * (z / radius)


@numba.njit(cache=True, nogil=True)
def _turned(col: float, row: float, depth: float, axes: Floats) -> tuple[float, float, float]:
    """A place along the axes: two coordinates on the plane, and the height over it."""
    return (
        axes[0, 0] * col + axes[0, 1] * row + axes[0, 2] * depth,
        axes[1, 0] * col + axes[1, 1] * row + axes[1, 2] * depth,
        axes[2, 0] * col + axes[2, 1] * row + axes[2, 2] * depth,
    )


@numba.njit(cache=True, nogil=True)
def _moments(
    data: Floats, weight: Floats, i: int, j: int, radius: int, level: float, steep: float, axes: Floats,
    normal: Floats, right: Floats,
) -> tuple[int, float]:  # fmt: skip
    """Write the packed normal matrix and the right side (CUBIC,) of a window; its samples, and their sum of squares."""
    normal[:] = 0.0
    right[:] = 0.0
    count, square, basis = 0, 0.0, np.ones(CUBIC)
    for m in range(max(0, i - radius), min(data.shape[0], i + radius + 1)):
        for n in range(max(0, j - radius), min(data.shape[1], j + radius + 1)):
            if weight[m, n] <= 0.0:
                continue
            a, b, height = _turned(n - j, m - i, (data[m, n] - level) / steep, axes)
            _set_basis(a, b, basis)
            k = 0
            for p in range(CUBIC):
                share = weight[m, n] * basis[p]
                right[p] += share * height
                for q in range(p + 1):
                    normal[k] += share * basis[q]
                    k += 1
            square += weight[m, n] * height * height
            count += 1
    return count, square


@numba.njit(cache=True, nogil=True)
def _set_basis(a: float, b: float, basis: Floats) -> None:
    """Write the terms (CUBIC,) at a place on the plane, in the order of ALL_POWERS."""
    basis[1], basis[2] = a, b
    basis[3], basis[4], basis[5] = a * a, a * b, b * b
    basis[6], basis[7], basis[8], basis[9] = a * a * a, a * a * b, a * b * b, b * b * b


@numba.njit(cache=True, nogil=True)
def _solve(
    normal: Floats, right: Floats, count: int, square: float, factor: Floats, solution: Floats, surface: Floats
) -> tuple[int, tuple[float, float]]:
    """Write the factor (CUBIC, CUBIC) and what its triangle makes of the right side (CUBIC,).

    Returns how many terms the surface needs, 0 where the samples determine none, and the variances about a cubic and
    about a quadratic.
    """
    full = count >= 2 * CUBIC and _cholesky(normal, factor, ALL_POWERS)
    if not full and (count < MIN_SAMPLES or not _cholesky(normal, factor, POWERS)):
        return 0, (np.nan, np.nan)
    unit = np.zeros(CUBIC)
    solution[:], unit[0] = 0.0, 1.0
    for p in range(CUBIC if full else QUADRATIC):
        entry, trace = right[p], unit[p]
        for q in range(p):
            entry -= factor[p, q] * solution[q]
            trace -= factor[p, q] * unit[q]
        solution[p], unit[p] = entry * factor[p, p], trace * factor[p, p]
    leverage, explained = unit * unit * normal[0], solution * solution
    left = max(square - explained[:QUADRATIC].sum(), 0.0)
    variance = left / (count - QUADRATIC)
    if leverage[:QUADRATIC].sum() > MAX_LEVERAGE * count:
        return 0, (np.nan, np.nan)
    if not full or leverage.sum() > MAX_LEVERAGE * count:
        return QUADRATIC, (np.nan, variance)
    _substitute_back(factor, solution, QUADRATIC, surface)
    gain, rise = explained[QUADRATIC:].sum(), np.abs(surface[3:QUADRATIC]).sum()
    rest = max(left - gain, 0.0) / (count - CUBIC)
    rises, misses = rise * rise > MAX_BEND * MAX_BEND * variance, gain > (CUBIC - QUADRATIC) * BY_CHANCE * rest
    return CUBIC if rises or misses else QUADRATIC, (rest, variance)


@numba.njit(cache=True, nogil=True)
def _cholesky(packed: Floats, factor: Floats, powers: Powers) -> bool:
    """Factor (t, t) of a packed symmetric matrix, in place; False when the samples do not determine the t terms.

    Its diagonal holds the reciprocals of its own entries: to divide takes as long as ten products. The powers are a
    tuple, whose length the compiler knows.
    """
    k = 0
    for i in range(len(powers)):
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
def _substitute_back(factor: Floats, solution: Floats, terms: int, surface: Floats) -> None:
    """Write the coefficients (CUBIC,) of so many terms, 0 for the others, from what the factor's triangle gave."""
    surface[:] = 0.0
    for p in range(terms - 1, -1, -1):
        entry = solution[p]
        for q in range(p + 1, terms):
            entry -= factor[q, p] * surface[q]
        surface[p] = entry * factor[p, p]


@numba.njit(cache=True, nogil=True)
def _on_line_of_sight(col: int, row: int, axes: Floats, s: Floats) -> tuple[float, float, float]:
    """Depth of the surface s (CUBIC,) on a line of sight, and its change per column and row; NaN for too far a turn.

    By Newton's method on the height over the plane, whose slopes in (col, row, depth) are those of the surface.
    """
    depth, slopes = -(axes[2, 0] * col + axes[2, 1] * row) / axes[2, 2], axes[2].copy()
    for _ in range(ROUNDS):
        a, b, over = _turned(col, row, depth, axes)
        height = s[0] + s[1] * a + s[2] * b + s[3] * a * a + s[4] * a * b + s[5] * b * b
        height += s[6] * a * a * a + s[7] * a * a * b + s[8] * a * b * b + s[9] * b * b * b
        along_a = s[1] + 2 * s[3] * a + s[4] * b + 3 * s[6] * a * a + 2 * s[7] * a * b + s[8] * b * b
        along_b = s[2] + s[4] * a + 2 * s[5] * b + s[7] * a * a + 2 * s[8] * a * b + 3 * s[9] * b * b
        slopes = axes[2] - along_a * axes[0] - along_b * axes[1]
        if slopes[2] <= 0.0 or along_a * along_a + along_b * along_b > MAX_TURN * MAX_TURN:
            return np.nan, np.nan, np.nan
        depth -= (over - height) / slopes[2]
    return depth, -slopes[0] / slopes[2], -slopes[1] / slopes[2]
