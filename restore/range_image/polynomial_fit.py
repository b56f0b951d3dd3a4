"""Fit a polynomial to the window round every sample of a grid at once."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from restore.bands import in_bands
from restore.scan import Floats, Ints, Mask

# Powers of (col, row) of the terms: the first six are a quadratic's, all ten a cubic's.
POWERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3))
Powers = tuple[tuple[int, int], ...]
QUADRATIC, CUBIC = 2, 3  # degrees
TERMS = {QUADRATIC: 6, CUBIC: 10}
SAMPLES_PER_TERM = 2  # at least
SINGULAR = 1e-5  # of the weight: a smaller pivot means that the samples lie on one side only
MAX_LEVERAGE = 1.0  # variance of the value at the centre over that of one sample: no fit may be worse


class Polynomials(NamedTuple):
    """A polynomial for each sample, NaN where its window has too few samples.

    terms     (rows, cols, t) coefficients in the order of POWERS, in samples from the centre of the window.
    variance  (rows, cols) weighted variance of the samples about the polynomial.
    """

    terms: Floats
    variance: Floats


class Moments(NamedTuple):
    """Which moments of a window a fit of some degree needs.

    Down a column are summed: weights times the row to 0 … twice the degree, weighted data times the row to 0 … the
    degree, weighted squares of the data, and the number of samples.

    rows    (k, 2) power of the col, and which sum down the columns: first those of the weights, then those of the
            weighted data in the order of POWERS, the sum of squares, the number of samples.
    packed  (t,) which moment stands at each place of the normal matrix's lower triangle, row by row.
    """

    rows: Ints
    packed: Ints


def _moments(degree: int) -> Moments:
    powers, twice = POWERS[: TERMS[degree]], 2 * degree + 1
    weights = [(p, q) for p in range(twice) for q in range(twice - p)]
    rows = [*weights, *((p, twice + q) for p, q in powers), (0, twice + degree + 1), (0, twice + degree + 2)]
    packed = [weights.index((a + c, b + d)) for i, (a, b) in enumerate(powers) for c, d in powers[: i + 1]]
    return Moments(np.array(rows), np.array(packed))


MOMENTS = {degree: _moments(degree) for degree in TERMS}


def fit_polynomials(
    data: Floats, weight: Floats, wanted: Mask, radius: int, degree: int = QUADRATIC, leverage: float = MAX_LEVERAGE
) -> Polynomials:
    """Fit data (rows, cols) with weights (rows, cols) in windows of 2·radius + 1 samples round every wanted sample.

    leverage is the most that a window may have: the variance of the value at its centre over that of one sample.
    """
    powers, fit = POWERS[: TERMS[degree]], MOMENTS[degree]
    terms, variance = np.full((*data.shape, len(powers)), np.nan), np.full(data.shape, np.nan)

    def fit_band(rows: slice) -> None:
        _fit_rows(data, weight, wanted, radius, powers, leverage, fit, rows.start, rows.stop, terms, variance)

    in_bands(fit_band, len(data))
    return Polynomials(terms, variance)


@numba.njit(cache=True, nogil=True)
def _fit_rows(
    data: Floats, weight: Floats, wanted: Mask, radius: int, powers: Powers, leverage: float, fit: Moments,
    first: int, end: int, terms: Floats, variance: Floats,
) -> None:  # fmt: skip
    """Write the terms and the variance of every wanted sample in the rows from first to end.

    A row's moments are sums down its columns, then along the row: they never leave the processor's cache.
    """
    rows, cols = data.shape
    degree = powers[-1][1]
    scale = np.array([float(radius) ** (p + q) for p, q in powers])
    down = np.zeros((3 * degree + 4, cols + 2 * radius))
    moments = np.empty((len(fit.rows), cols))
    for r in range(first, end):
        if not wanted[r].any():
            continue
        down[:] = 0.0
        for i in range(max(0, r - radius), min(rows, r + radius + 1)):
            _add_row(data[i], weight[i], (i - r) / radius, degree, down[:, radius : radius + cols])
        for k in range(len(fit.rows)):
            power, column = fit.rows[k]
            moments[k] = 0.0
            for j in range(2 * radius + 1):
                factor = ((j - radius) / radius) ** power
                for c in range(cols):
                    moments[k, c] += factor * down[column, j + c]
        _solve(moments, wanted[r], powers, fit.packed, leverage, scale, terms[r], variance[r])


@numba.njit(cache=True, nogil=True)
def _add_row(data: Floats, weight: Floats, y: float, degree: int, down: Floats) -> None:
    """Add a row of data (cols,) with weights (cols,) to the sums down the columns (…, cols); y: its offset."""
    power = 1.0
    for k in range(2 * degree + 1):
        for c in range(len(data)):
            down[k, c] += weight[c] * power
        if k <= degree:
            for c in range(len(data)):
                down[2 * degree + 1 + k, c] += weight[c] * data[c] * power
        power *= y
    for c in range(len(data)):
        down[3 * degree + 2, c] += weight[c] * data[c] * data[c]
        down[3 * degree + 3, c] += 1.0 if weight[c] > 0 else 0.0


@numba.njit(cache=True)
def _factor(packed: Floats, factor: Floats, powers: Powers) -> bool:
    """Cholesky factor (t, t) of a packed symmetric matrix; False when the window does not determine a polynomial.

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
def _solve(
    moments: Floats, wanted: Mask, powers: Powers, packed: Ints, most: float, scale: Floats,
    terms: Floats, variance: Floats,
) -> None:  # fmt: skip
    """Write the terms (cols, t) and the variance (cols,) of every wanted sample (cols,) of a row from its moments.

    most: leverage.
    """
    count, square = moments[-1], moments[-2]
    unknowns = len(powers)
    right = moments[len(moments) - 2 - unknowns : len(moments) - 2]
    normal, factor = np.empty(len(packed)), np.zeros((unknowns, unknowns))
    solution, unit = np.empty(unknowns), np.empty(unknowns)
    for c in range(len(wanted)):
        if not wanted[c] or count[c] < SAMPLES_PER_TERM * unknowns:
            continue
        for k in range(len(packed)):
            normal[k] = moments[packed[k], c]
        if not _factor(normal, factor, powers):
            continue
        # solution and unit run through the same triangle: the fit, and how much one sample moves its centre.
        explained, leverage = 0.0, 0.0
        for i in range(unknowns):
            entry, trace = right[i, c], 1.0 if i == 0 else 0.0
            for m in range(i):
                entry -= factor[i, m] * solution[m]
                trace -= factor[i, m] * unit[m]
            solution[i], unit[i] = entry * factor[i, i], trace * factor[i, i]
            explained += solution[i] ** 2
            leverage += unit[i] ** 2
        if leverage * normal[0] > most * count[c]:
            continue
        for i in range(unknowns - 1, -1, -1):
            entry = solution[i]
            for m in range(i + 1, unknowns):
                entry -= factor[m, i] * solution[m]
            solution[i] = entry * factor[i, i]
        variance[c] = max(square[c] - explained, 0.0) / (count[c] - unknowns)
        terms[c] = solution / scale
