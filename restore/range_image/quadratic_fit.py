"""Fit a quadratic to the window round every sample of a grid at once."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from restore.bands import in_bands
from restore.scan import Floats, Mask

Powers = tuple[tuple[int, int], ...]
# Powers of (col, row) of the six terms.
POWERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
MOMENTS = tuple((p, q) for p in range(5) for q in range(5 - p))
# Which moment stands at each place of the normal matrix's lower triangle, row by row.
PACKED = np.array([MOMENTS.index((a + c, b + d)) for i, (a, b) in enumerate(POWERS) for c, d in POWERS[: i + 1]])
SUMS = 10  # down a column: weights times the row to 0…4, weighted data times the row to 0…2, squares, samples
# The moments of windows: the power of the col, and which sum down the columns. First those of the weights in the order
# of MOMENTS, then those of the weighted data in the order of POWERS, its sum of squares, and the number of samples.
ROW_MOMENTS = np.array([*MOMENTS, *((p, 5 + q) for p, q in POWERS), (0, 8), (0, 9)])
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
    data: Floats, weight: Floats, wanted: Mask, radius: int, leverage: float = MAX_LEVERAGE
) -> Quadratics:
    """Fit data (rows, cols) with weights (rows, cols) in windows of 2·radius + 1 samples round every wanted sample.

    leverage is the most that a window may have: the variance of the value at its centre over that of one sample.
    """
    scale = np.array([float(radius) ** (p + q) for p, q in POWERS])
    terms, variance = np.full((*data.shape, len(POWERS)), np.nan), np.full(data.shape, np.nan)

    def fit_band(rows: slice) -> None:
        _fit_rows(data, weight, wanted, radius, scale, leverage, rows.start, rows.stop, terms, variance)

    in_bands(fit_band, len(data))
    return Quadratics(terms, variance)


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
    for r in range(first, end):
        left, right = _next_run(wanted[r], 0, 2 * radius)
        while left < right:
            _set_moments(data, weight, radius, r, left, right, down, moments)
            _solve(moments, wanted[r][left:right], scale, leverage, terms[r][left:right], variance[r][left:right])
            left, right = _next_run(wanted[r], right, 2 * radius)


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


@numba.njit(cache=True, nogil=True)
def cholesky(packed: Floats, factor: Floats, powers: Powers) -> bool:
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
def _solve(moments: Floats, wanted: Mask, scale: Floats, most: float, terms: Floats, variance: Floats) -> None:
    """Write the terms (cols, 6) and the variance (cols,) of every wanted sample (cols,) of a row from its moments.

    most: leverage.
    """
    right, square, count = moments[15:21], moments[21], moments[22]
    normal, factor = np.empty(21), np.zeros((6, 6))
    solution, unit = np.empty(6), np.empty(6)
    for c in range(len(wanted)):
        if not wanted[c] or count[c] < MIN_SAMPLES:
            continue
        for k in range(21):
            normal[k] = moments[PACKED[k], c]
        if not cholesky(normal, factor, POWERS):
            continue
        # solution and unit run through the same triangle: the fit, and how much one sample moves its centre.
        explained, leverage = 0.0, 0.0
        for i in range(6):
            entry, trace = right[i, c], 1.0 if i == 0 else 0.0
            for m in range(i):
                entry -= factor[i, m] * solution[m]
                trace -= factor[i, m] * unit[m]
            solution[i], unit[i] = entry * factor[i, i], trace * factor[i, i]
            explained += solution[i] ** 2
            leverage += unit[i] ** 2
        if leverage * normal[0] > most * count[c]:
            continue
        for i in range(5, -1, -1):
            entry = solution[i]
            for m in range(i + 1, 6):
                entry -= factor[m, i] * solution[m]
            solution[i] = entry * factor[i, i]
        variance[c] = max(square[c] - explained, 0.0) / (count[c] - 6.0)
        terms[c] = solution / scale
