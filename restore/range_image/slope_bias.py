"""What quadratics take off the slopes of a surface that bends to and fro, and how it is given back.

Where the surface is a cubic the slope of a quadratic is off, by so much of the third derivatives as the moments of the
window say. These are the second derivatives of the slopes: slopes a window away tell them with hardly any noise.
"""

from __future__ import annotations

import cv2
import numpy as np

from restore.range_image.facet_model import WIDE_RADIUS
from restore.scan import Floats, Mask

APART = 2 * WIDE_RADIUS + 1  # samples from one window to the next
SECOND_MOMENT = WIDE_RADIUS * (WIDE_RADIUS + 1) / 3
FOURTH_OVER_SECOND = (3 * WIDE_RADIUS * (WIDE_RADIUS + 1) - 1) / 5
ALONG = FOURTH_OVER_SECOND / 6  # x³/6, fitted by a quadratic in x and y, leaves so much of x
ACROSS = SECOND_MOMENT / 2  # and x·y²/2 so much
FULL = 1.0 - 1e-6  # share of a window


def unbiased(slope: Floats, sound: Mask) -> Floats:
    """(rows, cols, 2) the slopes per column and per row without their bias, where slopes a window away tell it.

    slope (rows, cols, 2) of quadratics; sound (rows, cols): those in the middle of whole windows.
    """
    across = _unbiased_along_rows(slope[..., 0], sound)
    down = _unbiased_along_rows(slope[..., 1].T, sound.T).T
    return np.stack([across, down], axis=-1)


def _unbiased_along_rows(slope: Floats, sound: Mask) -> Floats:
    """(rows, cols) slopes along the rows (rows, cols), without their bias."""
    known = np.where(sound, slope, 0.0), sound.astype(float)
    mean, share = (cv2.blur(values, (APART, APART), borderType=cv2.BORDER_CONSTANT) for values in known)
    mean[share < FULL] = np.nan
    return np.asarray(slope - ALONG * _second_differences(mean.T).T - ACROSS * _second_differences(mean))


def _second_differences(values: Floats) -> Floats:
    """(rows, cols) second differences down the columns, for each sample squared; 0 where a value is missing."""
    differences = np.zeros(values.shape)
    differences[APART:-APART] = (values[: -2 * APART] - 2.0 * values[APART:-APART] + values[2 * APART :]) / APART**2
    return np.nan_to_num(differences)
