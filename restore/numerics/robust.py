"""Robust statistics: the scale of noise among outliers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from restore.scan import Floats

# 1 / Φ⁻¹(3/4): the median absolute deviation of a normal distribution times this is its standard deviation (Rousseeuw &
# Croux, "Alternatives to the median absolute deviation", 1993).
MAD_TO_SIGMA = 1.4826
MAJORITY = 0.5  # of a whole: more is most of it
NEARLY_ALL = 0.9  # of a whole: the rest is its ragged border, holes, noise
SIGNIFICANT = 3.0  # standard deviations: of normal noise one in 370 lies farther out
CAUCHY = 2.5  # standard deviations, where an estimate of Cauchy's halves the weight, and Huber's begins to bound it
OUTLYING = 4.0  # standard deviations: of normal noise one in 16,000
NEVER = 10.0  # standard deviations: of normal noise none of millions


def robust_sigma(residuals: NDArray[Any]) -> float:
    """Return the standard deviation of residuals (…) about 0.

    In their unit; up to half of them may be outliers.
    """
    return MAD_TO_SIGMA * float(np.median(np.abs(residuals)))


def robust_sigmas(residuals: NDArray[Any]) -> Floats:
    """Return the standard deviations (k,) of the columns about 0.

    residuals: (n, k), of which up to half may be outliers.
    """
    return np.asarray(MAD_TO_SIGMA * np.median(np.abs(residuals), axis=0))
