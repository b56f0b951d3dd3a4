"""Fit a quadratic to the window round every sample of a grid at once."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numba
import numpy as np

from restore.bands import in_bands, in_threads
from restore.scan import Floats, Ints, Mask

# Powers of (col, row) of the six terms.
POWERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
MOMENTS = tuple((p, q) for p in range(5) for q in range(5 - p))
# Which moment stands at each place of the normal matrix's lower triangle, row by row.
PACKED = np.array([MOMENTS.index((a + c, b + d)) for i, (a, b) in enumerate(POWERS) for c, d in POWERS[: i + 1]])
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


def fit_quadratics(data: Floats, weight: Floats, wanted: Mask, radius: int) -> Quadratics:
    """Fit data (rows, cols) with weights (rows, cols) in windows of 2·radius + 1 samples round every wanted sample."""
    offsets = np.arange(-radius, radius + 1) / radius

    weighted = data * weight
    images = [weight] * len(MOMENTS) + [weighted] * len(POWERS) + [data * weighted, (weight > 0).astype(float)]
    moments = np.empty((len(images), *data.shape))

    def filter_moment(k: int) -> None:
        p, q = (*MOMENTS, *POWERS, (0, 0), (0, 0))[k]
        kernels = offsets**p, offsets**q
        cv2.sepFilter2D(images[k], cv2.CV_64F, *kernels, dst=moments[k], borderType=cv2.BORDER_CONSTANT)

    in_threads(filter_moment, range(len(images)))
    determined = wanted & (moments[-1] >= MIN_SAMPLES)
    scale = np.array([float(radius) ** (p + q) for p, q in POWERS])
    terms, variance = np.full((*data.shape, len(POWERS)), np.nan), np.full(data.shape, np.nan)
    in_bands(lambda rows: _solve(moments, PACKED, determined, scale, rows.start, rows.stop, terms, variance), len(data))
    return Quadratics(terms, variance)


@numba.njit(cache=True)
def _factor(packed: Floats, factor: Floats) -> bool:
    """Cholesky factor (6, 6) of a packed symmetric matrix; False when the window does not determine a quadratic."""
    k = 0
    for i in range(6):
        for j in range(i + 1):
            entry = packed[k]
            k += 1
            for m in range(j):
                entry -= factor[i, m] * factor[j, m]
            if i > j:
                factor[i, j] = entry / factor[j, j]
            elif entry > SINGULAR * packed[0]:
                factor[i, i] = np.sqrt(entry)
            else:
                return False
    return True


@numba.njit(cache=True, nogil=True)
def _solve(
    moments: Floats, packed: Ints, wanted: Mask, scale: Floats, first: int, end: int, terms: Floats, variance: Floats
) -> None:
    """Write the terms and the variance of every wanted sample in the rows from first to end.

    moments (23, rows, cols): of the weights in the order of MOMENTS, of the weighted data in the order of POWERS, the
    weighted sum of squares, the number of samples.
    """
    _, _, cols = moments.shape
    right, square, count = moments[15:21], moments[21], moments[22]
    normal, factor = np.empty(21), np.zeros((6, 6))
    solution, unit = np.empty(6), np.empty(6)
    for r in range(first, end):
        for c in range(cols):
            if not wanted[r, c]:
                continue
            for k in range(21):
                normal[k] = moments[packed[k], r, c]
            if not _factor(normal, factor):
                continue
            # solution and unit run through the same triangle: the fit, and how much one sample moves its centre.
            explained, leverage = 0.0, 0.0
            for i in range(6):
                entry, trace = right[i, r, c], 1.0 if i == 0 else 0.0
                for m in range(i):
                    entry -= factor[i, m] * solution[m]
                    trace -= factor[i, m] * unit[m]
                solution[i], unit[i] = entry / factor[i, i], trace / factor[i, i]
                explained += solution[i] ** 2
                leverage += unit[i] ** 2
            if leverage * normal[0] > MAX_LEVERAGE * count[r, c]:
                continue
            for i in range(5, -1, -1):
                entry = solution[i]
                for m in range(i + 1, 6):
                    entry -= factor[m, i] * solution[m]
                solution[i] = entry / factor[i, i]
            variance[r, c] = max(square[r, c] - explained, 0.0) / (count[r, c] - 6.0)
            terms[r, c] = solution / scale
