"""Fit a quadratic to the window round every sample of a grid at once."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from restore.mesh.jets import row_of
from restore.runtime.threads import in_bands
from restore.scan import Floats, Ints, Mask

# Powers of (col, row) of the six terms.
POWERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
MOMENTS = tuple((p, q) for p in range(5) for q in range(5 - p))
# Which moment stands at each place of the normal matrix's lower triangle, row by row.
PACKED = np.array([MOMENTS.index((a + c, b + d)) for i, (a, b) in enumerate(POWERS) for c, d in POWERS[: i + 1]])
SUMS = 10  # down a column: weights times the row to 0…4, weighted data times the row to 0…2, squares, samples
# The moments of windows: the power of the col, and which sum down the columns. First those of the weights in the order
# of MOMENTS, then those of the weighted data in the order of POWERS, its sum of squares, and the number of samples.
ROW_MOMENTS = np.array([*MOMENTS, *((p, 5 + q) for p, q in POWERS), (0, 8), (0, 9)])
AT_ONCE = 64  # systems that are solved side by side: with their factors they fill the processor's nearest cache
MIN_SAMPLES = 12  # twice the unknowns
SINGULAR = 1e-5  # of the weight: a smaller pivot means that the samples lie on one side only
MAX_LEVERAGE = 1.0  # variance of the value at the centre over that of one sample: no fit may be worse


class Quadratics(NamedTuple):
    """A quadratic for each sample, NaN where its window has too few samples.

    terms     (rows, cols, 6) coefficients in the order of POWERS, in samples from the centre of the window.
    variance  (rows, cols) weighted variance of the samples about the quadratic.
    """

    terms: Floats
    variance: Floats


def fit_quadratics(
    data: Floats,
    weight: Floats,
    wanted: Mask,
    radius: int,
    leverage: float = MAX_LEVERAGE,
    *,
    replacing: Quadratics | None = None,
) -> Quadratics:
    """Fit data (rows, cols) with weights (rows, cols) in windows of 2·radius + 1 samples round every wanted sample.

    leverage is the most that a window may have: the variance of the value at its centre over that of one sample.
    The fits take the place of others, if any, whose arrays they are written to: samples not wanted keep theirs.
    """
    scale = np.array([float(radius) ** (p + q) for p, q in POWERS])
    fits = replacing or Quadratics(np.empty((*data.shape, len(POWERS))), np.empty(data.shape))

    def fit_band(rows: slice) -> None:
        if replacing is None:
            fits.terms[rows], fits.variance[rows] = np.nan, np.nan
        _fit_rows(data, weight, wanted, radius, scale, leverage, rows.start, rows.stop, *fits)

    in_bands(fit_band, len(data))
    return fits


@numba.njit(cache=True, nogil=True)
def _fit_rows(
    data: Floats, weight: Floats, wanted: Mask, radius: int, scale: Floats, leverage: float, first: int, end: int,
    terms: Floats, variance: Floats,
) -> None:  # fmt: skip
    """Write the terms and the variance of every wanted sample in the rows from first to end.

    A row's moments are sums down its columns, then along the row: they never leave the processor's cache. Only those of
    the runs of columns that hold wanted samples are taken.
    """
    cols = data.shape[1]
    down, moments = np.empty((SUMS, cols + 2 * radius)), np.empty((len(ROW_MOMENTS), cols))
    own, places, count = np.empty((len(ROW_MOMENTS), AT_ONCE)), np.empty((AT_ONCE, 2), np.int64), 0
    for r in range(first, end):
        left, right = _next_run(wanted[r], 0, 2 * radius)
        while left < right:
            _set_moments(data, weight, radius, r, left, right, down, moments)
            for c in range(left, right):
                if not wanted[r, c]:
                    continue
                terms[r, c], variance[r, c] = np.nan, np.nan
                if moments[22, c - left] < MIN_SAMPLES:
                    continue
                own[:, count], places[count, 0], places[count, 1] = moments[:, c - left], r, c
                count += 1
                if count == AT_ONCE:
                    _solve(own, places, scale, leverage, terms, variance)
                    count = 0
            left, right = _next_run(wanted[r], right, 2 * radius)
    _solve(own[:, :count].copy(), places[:count], scale, leverage, terms, variance)


@numba.njit(cache=True, nogil=True)
def _set_moments(
    data: Floats, weight: Floats, radius: int, r: int, left: int, right: int, down: Floats, moments: Floats
) -> None:
    """Write the moments of the windows round the columns of a row from left to right, to the first columns of moments.

    down is for the sums down the columns: beyond the border of the grid they are 0.
    """
    rows, cols = data.shape
    count, before = right - left, left - radius
    start, stop = max(0, before), min(cols, right + radius)
    down[:, : count + 2 * radius] = 0.0
    for i in range(max(0, r - radius), min(rows, r + radius + 1)):
        _add_row(data[i][start:stop], weight[i][start:stop], (i - r) / radius, down, start - before)
    for k in range(len(ROW_MOMENTS)):
        power, column = ROW_MOMENTS[k]
        moments[k, :count] = 0.0
        for j in range(2 * radius + 1):
            factor = ((j - radius) / radius) ** power
            for c in range(count):
                moments[k, c] += factor * down[column, j + c]


@numba.njit(cache=True, nogil=True)
def _next_run(wanted: Mask, start: int, most: int) -> tuple[int, int]:
    """First and end of the next run of wanted columns (cols,), over gaps of up to `most`; equal when there is none."""
    while start < len(wanted) and not wanted[start]:
        start += 1
    end = start
    for col in range(start, len(wanted)):
        if wanted[col]:
            end = col + 1
        elif col - end >= most:
            break
    return start, end


@numba.njit(cache=True, nogil=True)
def _add_row(data: Floats, weight: Floats, y: float, down: Floats, first: int) -> None:
    """Add a row of data (k,) with weights (k,), at an offset y, to the sums down columns (SUMS, …) from a first on."""
    for c in range(len(data)):
        light = weight[c]
        value = light * data[c]
        down[0, first + c] += light
        down[1, first + c] += light * y
        down[2, first + c] += light * y**2
        down[3, first + c] += light * y**3
        down[4, first + c] += light * y**4
        down[5, first + c] += value
        down[6, first + c] += value * y
        down[7, first + c] += value * y**2
        down[8, first + c] += value * data[c]
        down[9, first + c] += 1.0 if light > 0 else 0.0


# What follows works on the systems of many samples side by side, of which the processor computes several at a time: so
# none is left out, and one without a solution has NaN.


@numba.njit(cache=True, nogil=True)
def _solve(moments: Floats, places: Ints, scale: Floats, most: float, terms: Floats, variance: Floats) -> None:
    """Write the terms (rows, cols, 6) and the variance (rows, cols) of samples with moments (23, n) at places (n, 2).

    most: leverage.
    """
    square, samples = moments[21], moments[22]
    factor, determined = _factor(moments)
    solution, explained, leverage = _substitute(moments, factor)
    for n in range(len(places)):
        if not determined[n] or leverage[n] * moments[0, n] > most * samples[n]:
            continue
        r, c = places[n]
        variance[r, c] = max(square[n] - explained[n], 0.0) / (samples[n] - 6.0)
        for i in range(len(POWERS)):
            terms[r, c, i] = solution[i, n] / scale[i]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _factor(moments: Floats) -> tuple[Floats, Mask]:
    """The Cholesky factors (21, n) of normal matrices, both packed, and (n,) True where samples determine the terms.

    Their diagonals hold the reciprocals of their own entries: to divide takes as long as ten products.
    """
    count = moments.shape[1]
    factor, determined = np.empty((len(PACKED), count)), np.ones(count, np.bool_)
    for i in range(len(POWERS)):
        for j in range(i + 1):
            k, row, other = row_of(i) + j, row_of(i), row_of(j)
            for n in range(count):
                factor[k, n] = moments[PACKED[k], n]
            for m in range(j):
                for n in range(count):
                    factor[k, n] -= factor[row + m, n] * factor[other + m, n]
            if i > j:
                for n in range(count):
                    factor[k, n] *= factor[other + j, n]
                continue
            for n in range(count):
                determined[n] &= factor[k, n] > SINGULAR * moments[0, n]
                factor[k, n] = 1.0 / np.sqrt(factor[k, n])
    return factor, determined


@numba.njit(cache=True, nogil=True)
def _substitute(moments: Floats, factor: Floats) -> tuple[Floats, Floats, Floats]:
    """The solutions (6, n), the squares (n,) that they explain, and their leverages (n,)."""
    count = moments.shape[1]
    # solution and unit run through the same triangle: the fit, and how much one sample moves its centre.
    solution, unit = moments[len(MOMENTS) : len(MOMENTS) + len(POWERS)].copy(), np.zeros((len(POWERS), count))
    explained, leverage = np.zeros(count), np.zeros(count)
    unit[0] = 1.0
    for i in range(len(POWERS)):
        for m in range(i):
            k = row_of(i) + m
            for n in range(count):
                solution[i, n] -= factor[k, n] * solution[m, n]
                unit[i, n] -= factor[k, n] * unit[m, n]
        k = row_of(i) + i
        for n in range(count):
            solution[i, n] *= factor[k, n]
            unit[i, n] *= factor[k, n]
            explained[n] += solution[i, n] ** 2
            leverage[n] += unit[i, n] ** 2
    for i in range(len(POWERS) - 1, -1, -1):
        for m in range(i + 1, len(POWERS)):
            k = row_of(m) + i
            for n in range(count):
                solution[i, n] -= factor[k, n] * solution[m, n]
        k = row_of(i) + i
        for n in range(count):
            solution[i, n] *= factor[k, n]
    return solution, explained, leverage
