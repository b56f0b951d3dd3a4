"""A line through points of which some are outliers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restore.numerics.lines import theil_sen


@given(st.floats(-5, 5), st.floats(-100, 100), st.integers(0, 5))
def test_a_quarter_of_outliers_does_not_move_it(slope, offset, outliers):
    x = np.arange(24.0)
    y = slope * x + offset
    y[3 : 3 + outliers] += 1e3
    assert theil_sen(x, y) == (pytest.approx(slope, abs=1e-9), pytest.approx(offset, abs=1e-9))


def test_points_of_one_place_have_their_median():
    assert theil_sen(np.ones(3), np.array([1.0, 2.0, 9.0])) == (0.0, 2.0)
