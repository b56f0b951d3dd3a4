"""Bias and scatter of the slopes of facets.

A cubic term biases the slope of a quadratic by the third derivatives of the surface, times moments of the window. They
are the second derivatives of the slopes, estimated from mean slopes a window apart, which adds little noise.
A path along facets whose slopes scatter is longer than the surface is, in the mean by half the variance of the slope.
The noise of single samples does not show it: near print, the errors of samples are correlated. But slopes of windows
without common samples scatter independently, and on smooth paper their third differences have hardly anything else in
them.
"""

from __future__ import annotations

import cv2
import numpy as np

from restore.range_image.facets.facet_model import WIDE_RADIUS
from restore.scan import Floats, Mask

SQUARED = 1.0 + 9.0 + 9.0 + 1.0  # coefficients of a third difference: its variance over that of a slope
MOST = 12.0  # medians of the squares: a bend that was not found to be a crease; of normal noise all but one in 50
KEPT = 0.876  # of the mean square of normal noise have those within: at MOST medians, the distribution function of χ²
# with three degrees of freedom over that with one
LINES = 4  # from row to row that is looked at: windows in between have mostly the same samples
FULL = 1.0 - 1e-6  # fraction of a window


def slope_variances(slope: Floats, sound: Mask, radius: int = WIDE_RADIUS) -> Floats:
    """Return the variance of the slopes per column and per row, (1/mm)².

    slope: (rows, cols, 2), of facets.
    sound: (rows, cols), those in the centre of whole windows of a radius, samples.
    Returns (2,), 0 on a page too narrow for a third difference.
    """
    apart = 2 * radius + 1
    across = _along_rows(slope[::LINES, :, 0], sound[::LINES], apart)
    down = _along_rows(slope[:, ::LINES, 1].T, sound[:, ::LINES].T, apart)
    return np.array([across, down])


def _along_rows(slope: Floats, sound: Mask, apart: int) -> float:
    """Return the variance of a slope (rows, cols) along the rows, without what is not noise."""
    known = np.where(sound, slope, np.nan)
    first, second = known[:, : -3 * apart], known[:, apart : -2 * apart]
    third, fourth = known[:, 2 * apart : -apart], known[:, 3 * apart :]
    squares = (first - 3.0 * second + 3.0 * third - fourth) ** 2 / SQUARED
    squares = squares[np.isfinite(squares)]
    return float(squares[squares <= MOST * np.median(squares)].mean() / KEPT) if squares.size else 0.0


def unbiased(slope: Floats, sound: Mask, radius: int = WIDE_RADIUS) -> Floats:
    """Return the slopes per column and row without their bias.

    They are corrected where the slopes a window away are known.
    slope: (rows, cols, 2), of quadratics.
    sound: (rows, cols), those in the centre of whole windows of a radius, samples.
    """
    across = _unbiased_along_rows(slope[..., 0], sound, radius)
    down = _unbiased_along_rows(slope[..., 1].T, sound.T, radius).T
    return np.stack([across, down], axis=-1)


def cubic_biases(radius: int) -> tuple[float, float]:
    """Return the slopes in x of the quadratics that fit x³/6 and x·y²/2.

    The true ones are 0.
    """
    second_moment = radius * (radius + 1) / 3
    fourth_over_second = (3 * radius * (radius + 1) - 1) / 5
    return fourth_over_second / 6, second_moment / 2


def _unbiased_along_rows(slope: Floats, sound: Mask, radius: int) -> Floats:
    """Return slopes along the rows (rows, cols), corrected."""
    apart, (along, across) = 2 * radius + 1, cubic_biases(radius)
    known = np.where(sound, slope, 0.0), sound.astype(float)
    mean, fraction = (cv2.blur(values, (apart, apart), borderType=cv2.BORDER_CONSTANT) for values in known)
    mean[fraction < FULL] = np.nan
    return np.asarray(slope - along * _second_differences(mean.T, apart).T - across * _second_differences(mean, apart))


def _second_differences(values: Floats, apart: int) -> Floats:
    """Return second differences (rows, cols) down the columns.

    For each sample squared; 0 where a value is missing.
    """
    differences = np.zeros(values.shape)
    differences[apart:-apart] = (values[: -2 * apart] - 2.0 * values[apart:-apart] + values[2 * apart :]) / apart**2
    differences[np.isnan(differences)] = 0.0
    return differences
