"""The scale of noise does not depend on outliers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from restore.numerics.robust import MAD_TO_SIGMA, robust_sigma, robust_sigmas

DIGITS = 5e-5  # MAD_TO_SIGMA is written with four decimals
SAMPLING = 0.05  # relative, 6 standard errors: that of the scale of 20,000 normal samples by their median is 0.008
OUTLIERS = 0.05  # of the samples; so many move the median to another quantile of the rest
BIAS = 0.1  # relative: the quantile 0.5 / 0.95 of |x| in place of the median adds 0.07


def test_the_factor_is_that_of_a_normal_distribution():
    assert pytest.approx(1 / norm.ppf(0.75), abs=DIGITS) == MAD_TO_SIGMA


@given(seed=st.integers(0, 2**32 - 1), sigma=st.floats(1e-12, 1e6))
def test_the_sigma_of_normal_noise_is_estimated_in_spite_of_outliers(seed, sigma):
    noise = sigma * np.random.default_rng(seed).standard_normal(20_000)
    assert robust_sigma(noise) == pytest.approx(sigma, rel=SAMPLING)
    noise[: int(OUTLIERS * len(noise))] = 1e9 * sigma
    assert robust_sigma(noise) == pytest.approx(sigma, rel=BIAS + SAMPLING)


def test_columns_are_estimated_independently():
    columns = np.random.default_rng(0).standard_normal((50, 3)) * [1.0, 10.0, 100.0]
    np.testing.assert_array_equal(robust_sigmas(columns), [robust_sigma(column) for column in columns.T])
