"""Fit a quadratic to the window round every sample of a grid at once."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

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


class Systems(NamedTuple):
    """Normal equations of AT_ONCE samples, and scratch for their solution.

    moments  (23, n) in the order of ROW_MOMENTS, places (n, 2) row and column of the sample.
    factor   (21, n) Cholesky factors of the normal matrices, packed; their diagonals hold the reciprocals of their own
             entries, as to divide takes as long as ten products.
    solution, unit (6, n): what runs through the same triangle: the fit, and how much one sample moves its centre.
    leverage, explained (n,): the squares of unit and solution.
    """

    moments: Floats
    places: Ints
    factor: Floats
    solution: Floats
    unit: Floats
    leverage: Floats
    explained: Floats


def _systems() -> Systems:
    rows = (len(PACKED), len(POWERS), len(POWERS))
    places, moments = np.empty((AT_ONCE, 2), np.int64), np.empty((len(ROW_MOMENTS), AT_ONCE))
    return Systems(moments, places, *(np.empty((k, AT_ONCE)) for k in rows), *np.empty((2, AT_ONCE)))


def fit_quadratics(
    data: Floats,
    weight: Floats,
    wanted: Mask,
    radius: int,
    leverage: float = MAX_LEVERAGE,
    *,
    replacing: Quadratics | None = None,
) -> Quadratics:
    """Fit quadratics in windows round every wanted sample.

    The fits replace others, if any, whose arrays they are written to: samples not wanted keep theirs.
    data, weight: (rows, cols).
    radius: the window has 2·radius + 1 samples.
    leverage: the most that a window may have: the variance of the value at its centre over that of one sample.
    """
    scale = np.array([float(radius) ** (p + q) for p, q in POWERS])
    fits = replacing or Quadratics(np.empty((*data.shape, len(POWERS))), np.empty(data.shape))

    def fit_band(rows: slice) -> None:
        if replacing is None:
            fits.terms[rows], fits.variance[rows] = np.nan, np.nan
        down, moments = np.empty((SUMS, data.shape[1] + 2 * radius)), np.empty((len(ROW_MOMENTS), data.shape[1]))
        scratch = down, moments, _systems()
        _fit_rows(data, weight, wanted, radius, scale, leverage, rows.start, rows.stop, *fits, *scratch)

    in_bands(fit_band, len(data))
    return fits


@numba.njit(cache=True, nogil=True)
def _fit_rows(
    data: Floats, weight: Floats, wanted: Mask, radius: int, scale: Floats, leverage: float, first: int, end: int,
    terms: Floats, variance: Floats, down: Floats, moments: Floats, systems: Systems,
) -> None:  # fmt: skip
    """Write the terms and the variance of wanted samples of some rows.

    The rows are from first to end. A row's moments are sums down its columns, then along the row: they never leave the
    processor's cache. Only those of the runs of columns that hold wanted samples are taken.
    down: (SUMS, cols + 2 · radius), scratch.
    moments: (23, cols), scratch, as are the systems.
    """
    count = np.int64(0)  # a plain 0 would have _solve compiled for that number, too
    for r in range(first, end):
        right = 0
        while True:
            left, right = _next_run(wanted, r, right, 2 * radius)
            if left == right:
                break
            _set_moments(data, weight, radius, r, left, right, down, moments)
            for k in range(right - left):
                c = left + k
                if not wanted[r, c]:
                    continue
                variance[r, c] = np.nan
                for i in range(len(POWERS)):
                    terms[r, c, i] = np.nan
                if moments[22, k] < MIN_SAMPLES:
                    continue
                for i in range(len(ROW_MOMENTS)):
                    systems.moments[i, count] = moments[i, k]
                systems.places[count, 0], systems.places[count, 1] = r, c
                count += 1
                if count == AT_ONCE:
                    _solve(systems, count, scale, leverage, terms, variance)
                    count = np.int64(0)
    _solve(systems, count, scale, leverage, terms, variance)


@numba.njit(cache=True, nogil=True, inline="always")
def _set_moments(
    data: Floats, weight: Floats, radius: int, r: int, left: int, right: int, down: Floats, moments: Floats
) -> None:
    """Write the moments of the windows round some columns of a row.

    The columns from left to right go to the first columns of moments.
    down: sums down the columns; beyond the border of the grid they are 0.
    """
    rows, cols = data.shape
    count, before = right - left, left - radius
    start, stop = max(0, before), min(cols, right + radius)
    first = start - before
    for column in range(SUMS):
        for c in range(count + 2 * radius):
            down[column, c] = 0.0
    for i in range(max(0, r - radius), min(rows, r + radius + 1)):
        y, values, weights = (i - r) / radius, data[i, start:stop], weight[i, start:stop]
        for c in range(stop - start):
            light = weights[c]
            value = light * values[c]
            down[0, first + c] += light
            down[1, first + c] += light * y
            down[2, first + c] += light * y**2
            down[3, first + c] += light * y**3
            down[4, first + c] += light * y**4
            down[5, first + c] += value
            down[6, first + c] += value * y
            down[7, first + c] += value * y**2
            down[8, first + c] += value * values[c]
            down[9, first + c] += 1.0 if light > 0 else 0.0
    for k in range(len(ROW_MOMENTS)):
        power, column = ROW_MOMENTS[k, 0], ROW_MOMENTS[k, 1]
        for c in range(count):
            moments[k, c] = 0.0
        for j in range(2 * radius + 1):
            factor = ((j - radius) / radius) ** power
            for c in range(count):
                moments[k, c] += factor * down[column, j + c]


@numba.njit(cache=True, nogil=True, inline="always")
def _next_run(wanted: Mask, r: int, start: int, most: int) -> tuple[int, int]:
    """Return first and end of the next run of wanted columns in a row.

    Gaps of up to `most` are included; both are equal when no column is left.
    """
    cols = wanted.shape[1]
    while start < cols and not wanted[r, start]:
        start += 1
    end = start
    for col in range(start, cols):
        if wanted[r, col]:
            end = col + 1
        elif col - end >= most:
            break
    return start, end


# What follows works on the systems of many samples side by side, of which the processor computes several at a time: so
# none is left out, and one without a solution has NaN.


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _solve(
    systems: Systems, count: int, scale: Floats, most: float, terms: Floats, variance: Floats
) -> None:  # fmt: skip
    """Solve the first `count` systems and write their samples.

    terms: (rows, cols, 6).
    variance: (rows, cols).
    most: leverage.
    """
    moments, places, factor, solution, unit, leverage, explained = systems
    for n in range(count):
        leverage[n] = explained[n] = 0.0
    for i in range(len(POWERS)):
        for j in range(i + 1):
            k, row, other = i * (i + 1) // 2 + j, i * (i + 1) // 2, j * (j + 1) // 2
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
                leverage[n] = leverage[n] if factor[k, n] > SINGULAR * moments[0, n] else np.nan
                factor[k, n] = 1.0 / np.sqrt(factor[k, n])
    for i in range(len(POWERS)):
        row = i * (i + 1) // 2
        for n in range(count):
            solution[i, n], unit[i, n] = moments[len(MOMENTS) + i, n], 1.0 if i == 0 else 0.0
        for m in range(i):
            for n in range(count):
                solution[i, n] -= factor[row + m, n] * solution[m, n]
                unit[i, n] -= factor[row + m, n] * unit[m, n]
        for n in range(count):
            solution[i, n] *= factor[row + i, n]
            unit[i, n] *= factor[row + i, n]
            explained[n] += solution[i, n] ** 2
            leverage[n] += unit[i, n] ** 2
    for i in range(len(POWERS) - 1, -1, -1):
        for m in range(i + 1, len(POWERS)):
            for n in range(count):
                solution[i, n] -= factor[m * (m + 1) // 2 + i, n] * solution[m, n]
        for n in range(count):
            solution[i, n] *= factor[i * (i + 1) // 2 + i, n]
    for n in range(count):
        samples = moments[22, n]
        if not leverage[n] * moments[0, n] <= most * samples:  # NaN where the samples do not determine the terms
            continue
        r, c = places[n, 0], places[n, 1]
        variance[r, c] = max(moments[21, n] - explained[n], 0.0) / (samples - 6.0)
        for i in range(len(POWERS)):
            terms[r, c, i] = solution[i, n] / scale[i]
