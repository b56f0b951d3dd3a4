"""A sheet with a swell, and what a cloud of it has to come back as."""

import numpy as np
import pytest

from oracles.clouds import colours_of_samples
from restore.scan import RangeScan
from tests.restore.formats.conftest import make_shot

SINGLE_MM = 2e-4  # rounding of single precision at 0.7 m, and of four decimals


@pytest.fixture
def sheet():
    return make_shot(24, 32, whole=True)


@pytest.fixture
def same_as():
    def check(scan, sheet, within=SINGLE_MM, colours=True):
        assert isinstance(scan, RangeScan)
        np.testing.assert_allclose(scan.points, sheet.points, atol=within)
        if colours:
            ours, theirs = (colours_of_samples(one)[sheet.measured] for one in (scan, sheet))
            np.testing.assert_array_equal(ours, theirs)

    return check
