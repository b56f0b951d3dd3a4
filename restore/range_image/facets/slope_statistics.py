"""How much the slopes of facets scatter, told by the facets themselves.

A way along facets whose slopes scatter is longer than the surface is, in the mean by half the variance of the slope.
The noise of single samples does not tell it: beside print, samples are off together. But slopes of windows that share
no sample scatter by themselves, and on smooth paper their third differences have hardly anything else in them.
"""

from __future__ import annotations

import cv2
import numpy as np

from restore.range_image.facets.facet_model import APART
from restore.scan import Floats, Mask

SQUARED = 1.0 + 9.0 + 9.0 + 1.0  # coefficients of a third difference: its variance over that of a slope
MOST = 12.0  # medians of the squares: a bend that was not found to be a crease; of normal noise all but one in 50
KEPT = 0.876  # of the mean square of normal noise have those within: at MOST medians, the distribution function of χ²
# with three degrees of freedom over that with one
LINES = 4  # from row to row that is looked at: windows of those between share most of their samples with them
AVERAGED = 61  # samples along a row, and the same across in every LINES-th: the square of which the mean is taken
OF_PAGE = 25.0  # squares by which the mean of the whole page counts besides


def slope_variances(slope: Floats, sound: Mask) -> Floats:
    """(rows, cols, 2) variance of the slope per column and of the slope per row, (1/mm)².

    slope (rows, cols, 2) of facets; sound (rows, cols): those in the middle of whole windows. 0 on a page too narrow
    for a third difference.
    """
    across = _along_rows(slope[..., 0], sound)
    down = _along_rows(slope[..., 1].T, sound.T).T
    return np.stack([across, down], axis=-1)


def _along_rows(slope: Floats, sound: Mask) -> Floats:
    """(rows, cols) variance of the slope along the rows; every row has that of the last row which was looked at."""
    found = _averaged(_squares_along_rows(slope[::LINES], sound[::LINES]))
    return np.repeat(found, LINES, axis=0)[: len(slope)]


def _squares_along_rows(slope: Floats, sound: Mask) -> Floats:
    """(rows, cols) squared third differences along the rows, as variances of a slope; NaN beside what is not sound."""
    known = np.where(sound, slope, np.nan)
    first, second = known[:, : -3 * APART], known[:, APART : -2 * APART]
    third, fourth = known[:, 2 * APART : -APART], known[:, 3 * APART :]
    squares, start = np.full(slope.shape, np.nan), 3 * APART // 2
    squares[:, start : start + first.shape[1]] = (first - 3.0 * second + 3.0 * third - fourth) ** 2 / SQUARED
    return squares


def _averaged(squares: Floats) -> Floats:
    """(rows, cols) mean of the squares round every sample, those left out that are no noise."""
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
