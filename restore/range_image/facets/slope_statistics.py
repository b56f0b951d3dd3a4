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
AVERAGED = 61  # samples along a row, and the same across in every LINES-th: the square of which the mean is taken
OF_PAGE = 25.0  # squares by which the mean of the whole page counts besides
FULL = 1.0 - 1e-6  # fraction of a window


def slope_variances(slope: Floats, sound: Mask, radius: int = WIDE_RADIUS) -> Floats:
    """Return the variance of the slopes per column and per row, (1/mm)².

    slope: (rows, cols, 2), of facets.
    sound: (rows, cols), those in the centre of whole windows of a radius, samples.
    Returns (rows, cols, 2), 0 on a page too narrow for a third difference.
    """
    across = _along_rows(slope[..., 0], sound, 2 * radius + 1)
    down = _along_rows(slope[..., 1].T, sound.T, 2 * radius + 1).T
    return np.stack([across, down], axis=-1)


def _along_rows(slope: Floats, sound: Mask, apart: int) -> Floats:
    """Return the variance (rows, cols) of the slope along the rows.

    Every row has that of the last row which was evaluated.
    """
    found = _averaged(_squares_along_rows(slope[::LINES], sound[::LINES], apart))
    return np.repeat(found, LINES, axis=0)[: len(slope)]


def _squares_along_rows(slope: Floats, sound: Mask, apart: int) -> Floats:
    """Return squared third differences along rows, as slope variances.

    Returns (rows, cols), NaN next to invalid slopes.
    """
    known = np.where(sound, slope, np.nan)
    first, second = known[:, : -3 * apart], known[:, apart : -2 * apart]
    third, fourth = known[:, 2 * apart : -apart], known[:, 3 * apart :]
    squares, start = np.full(slope.shape, np.nan), 3 * apart // 2
    squares[:, start : start + first.shape[1]] = (first - 3.0 * second + 3.0 * third - fourth) ** 2 / SQUARED
    return squares


def _averaged(squares: Floats) -> Floats:
    """Return the mean of the squares round every sample, (rows, cols).

    Those that are not noise are left out.
    """
    known = np.isfinite(squares)
    if not known.any():
        return np.zeros(squares.shape)
    known &= squares <= MOST * np.median(squares[known])
    mean = float(squares[known].mean())
    total, count = (
        cv2.boxFilter(
            values, cv2.CV_64F, (AVERAGED, AVERAGED // LINES), normalize=False, borderType=cv2.BORDER_CONSTANT
        )
        for values in (np.where(known, squares, 0.0), known.astype(float))
    )
    return np.asarray((total + OF_PAGE * mean) / (count + OF_PAGE) / KEPT)


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
