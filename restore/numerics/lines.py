"""Lines through points with outliers."""

from __future__ import annotations

import numpy as np

from restore.scan import Floats

MIN_POINTS = 10  # rows or samples: fewer do not determine the direction of an edge


def theil_sen(x: Floats, y: Floats) -> tuple[float, float]:
    """Return slope and offset of the line y = slope · x + offset.

    The median over all pairs of points (n,), (n,): up to 29 % of the points may be outliers (Theil 1950, Sen 1968).
    Points of one x have no slope.

    >>> theil_sen(np.arange(5.0), np.array([1.0, 3.0, 5.0, 7.0, 90.0]))
    (2.0, 1.0)
    """
    i, j = np.triu_indices(len(x), 1)
    apart = x[j] - x[i]
    slopes = (y[j] - y[i])[apart != 0] / apart[apart != 0]
    slope = float(np.median(slopes)) if len(slopes) else 0.0
    return slope, float(np.median(y - slope * x))
