"""Correct the bias of slopes that are fitted by quadratics.

A cubic term biases the slope of a quadratic by the third derivatives of the surface, times moments of the window. They
are the second derivatives of the slopes, estimated from mean slopes a window apart, which adds little noise.
"""

from __future__ import annotations

import cv2
import numpy as np

from restore.range_image.facets.facet_model import APART, WIDE_RADIUS
from restore.scan import Floats, Mask

SECOND_MOMENT = WIDE_RADIUS * (WIDE_RADIUS + 1) / 3
FOURTH_OVER_SECOND = (3 * WIDE_RADIUS * (WIDE_RADIUS + 1) - 1) / 5
ALONG = FOURTH_OVER_SECOND / 6  # slope in x of the quadratic that fits x³/6 best; the true one is 0
ACROSS = SECOND_MOMENT / 2  # the same for x·y²/2
FULL = 1.0 - 1e-6  # share of a window


def unbiased(slope: Floats, sound: Mask) -> Floats:
    """(rows, cols, 2) the slopes per column and per row, corrected where the slopes a window away are known.

    slope (rows, cols, 2) of quadratics; sound (rows, cols): those in the middle of whole windows.
    """
    across = _unbiased_along_rows(slope[..., 0], sound)
    down = _unbiased_along_rows(slope[..., 1].T, sound.T).T
    return np.stack([across, down], axis=-1)


def _unbiased_along_rows(slope: Floats, sound: Mask) -> Floats:
    """(rows, cols) slopes along the rows (rows, cols), corrected."""
    known = np.where(sound, slope, 0.0), sound.astype(float)
    mean, share = (cv2.blur(values, (APART, APART), borderType=cv2.BORDER_CONSTANT) for values in known)
    mean[share < FULL] = np.nan
    return np.asarray(slope - ALONG * _second_differences(mean.T).T - ACROSS * _second_differences(mean))


def _second_differences(values: Floats) -> Floats:
    """(rows, cols) second differences down the columns, for each sample squared; 0 where a value is missing."""
    differences = np.zeros(values.shape)
    differences[APART:-APART] = (values[: -2 * APART] - 2.0 * values[APART:-APART] + values[2 * APART :]) / APART**2
    differences[np.isnan(differences)] = 0.0
    return differences
