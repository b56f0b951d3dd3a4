"""Estimate the noise of a scan from the scan itself, and draw more of the kind."""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, cos, sin

import numpy as np

from restore.numerics.robust import OUTLYING, robust_sigma
from restore.range_image.facets.facet_model import SIGNAL_CLASSES, WIDE_RADIUS, signal_classes
from restore.range_image.facets.quadratic_fit import MIN_SAMPLES
from restore.range_image.facets.sheet import Sheet
from restore.scan import Floats

LAGS = ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (2, 0))  # rows and columns apart, at which residuals are compared
MAX_CORRELATION = 0.49  # of neighbours: a moving average of two has ½ at most


@dataclass(frozen=True, eq=False)
class Noise:
    """Noise of inverse depths.

    sigma        (rows, cols) standard deviation, 1/mm.
    along_row    correlation of a sample with the next of its row.
    along_column correlation of a sample with the next of its column.
    """

    sigma: Floats
    along_row: float
    along_column: float


def estimate_noise(sheet: Sheet, inverse_depth: Floats, signal: Floats | None) -> Noise:
    """Estimate the noise of inverse depths (rows, cols) 1/mm from the residuals of facets.

    signal (rows, cols): the light that each sample returned. Facets follow the noise of their own samples; the
    autocovariance of what they leave is that of the noise, filtered by one minus a quadratic fit, and is solved for it.
    """
    residual, good = inverse_depth - sheet.planes[..., 0], sheet.measured & sheet.inside
    classes = signal_classes(signal, good)
    sigmas = np.full(SIGNAL_CLASSES + 1, np.nan)
    for k in range(SIGNAL_CLASSES):
        members = residual[good & (classes == k)]
        if len(members) >= MIN_SAMPLES:
            sigmas[k] = robust_sigma(members)
    least = float(np.nanmin(sigmas))
    scale = np.where(np.isfinite(sigmas[classes]), sigmas[classes], least)
    relative = np.where(good & (np.abs(residual) < OUTLYING * scale), residual / scale, np.nan)
    variance, along_row, along_column = _solved([_autocovariance(relative, *lag) for lag in LAGS])
    return Noise(scale * np.sqrt(variance), along_row / variance, along_column / variance)


def draw_noise(noise: Noise, rng: np.random.Generator) -> Floats:
    """Draw (rows, cols) 1/mm: moving averages of two samples along both axes."""
    rows, cols = noise.sigma.shape
    white = rng.standard_normal((rows + 1, cols + 1))
    for axis, correlation in ((1, noise.along_row), (0, noise.along_column)):
        angle = 0.5 * asin(2.0 * float(np.clip(correlation, -MAX_CORRELATION, MAX_CORRELATION)))
        later, earlier = (np.delete(white, place, axis=axis) for place in (0, -1))
        white = cos(angle) * later + sin(angle) * earlier
    return np.asarray(white * noise.sigma)


def _autocovariance(values: Floats, down: int, right: int) -> float:
    """Average the products of values (rows, cols) with those some rows and columns on."""
    rows, cols = values.shape
    return float(np.nanmean(values[: rows - down, : cols - right] * values[down:, right:]))


def _solved(measured: list[float]) -> tuple[float, float, float]:
    """Solve for variance and covariances along rows and columns, from residuals at LAGS."""
    from scipy.signal import correlate2d  # brings scipy.stats, which a page without this does not need

    reach = 2 * WIDE_RADIUS
    left = -_value_filter()
    left[WIDE_RADIUS, WIDE_RADIUS] += 1.0
    response = np.pad(correlate2d(left, left), 3)  # so that each lag has an entry
    centre = 2 * reach // 2 + 3

    def effect(down: int, right: int) -> list[float]:
        """What noise that goes together over a step leaves at every lag."""
        steps = {(down, right), (-down, -right)}
        return [sum(response[centre + i - a, centre + j - b] for a, b in steps) for i, j in LAGS]

    design = np.array([effect(0, 0), effect(0, 1), effect(1, 0)]).T
    (variance, along_row, along_column), *_ = np.linalg.lstsq(design, np.array(measured), rcond=None)
    return float(variance), float(along_row), float(along_column)


def _value_filter() -> Floats:
    """Weigh the samples (7, 7) of a window by their part in the fitted value at its centre."""
    y, x = (axis.ravel() for axis in np.mgrid[-WIDE_RADIUS : WIDE_RADIUS + 1, -WIDE_RADIUS : WIDE_RADIUS + 1])
    terms = np.stack([np.ones(x.size), x, y, x * x, x * y, y * y], axis=1)
    return np.asarray(np.linalg.pinv(terms)[0].reshape(2 * WIDE_RADIUS + 1, -1))
