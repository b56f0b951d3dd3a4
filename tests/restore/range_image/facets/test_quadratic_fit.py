"""The quadratic fit round every sample of a grid, against dense least squares."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from restore.range_image.facets.quadratic_fit import MIN_SAMPLES, POWERS, Quadratics, fit_quadratics

ROWS, COLS = 24, 30
SMALLEST = 1e-290  # products of smaller numbers have fewer digits
EXACT = 1e-8  # of the data: rounding, times the condition of a window with nearly half of its samples gone
ROUNDING = 1e-9  # of a standard deviation
MAX_STANDARD_ERRORS = 4.0  # standard errors; a fixed seed, so this fails for a wrong estimate only

coefficients = st.lists(st.floats(-1.0, 1.0, allow_subnormal=False), min_size=6, max_size=6)
radii = st.sampled_from([2, 3])


def quadratic(terms, rows, cols):
    return sum(f * cols**p * rows**q for f, (p, q) in zip(terms, POWERS, strict=True))


def about(terms, row, col):
    """The same quadratic with its origin moved to (row, col)."""
    _, b, c, d, e, f = terms
    value = quadratic(terms, row, col)
    return np.stack([value, b + 2 * d * col + e * row, c + e * col + 2 * f * row, d, e, f])


@settings(max_examples=40, deadline=None)
@given(coefficients, radii, st.integers(0, 2**32 - 1), st.floats(0.0, 0.4))
def test_any_quadratic_is_recovered_whatever_the_gaps_and_weights(terms, radius, seed, gaps):
    random = np.random.default_rng(seed)
    rows, cols = (grid - 12.0 for grid in np.indices((ROWS, COLS)).astype(float))
    data = quadratic(terms, rows, cols)
    weight = random.uniform(0.2, 1.0, data.shape) * (random.random(data.shape) >= gaps)
    fit = fit_quadratics(np.where(weight > 0, data, 1e6), weight, np.ones(data.shape, bool), radius)
    known = np.isfinite(fit.variance)
    assert known.mean() > 0.5
    truth = np.stack([about(terms, r, c) for r, c in zip(rows[known], cols[known], strict=True)])
    scale = np.abs(data).max() + np.abs(truth).max()
    np.testing.assert_allclose(fit.terms[known], truth, atol=EXACT * scale + SMALLEST)


@pytest.mark.parametrize("radius", [2, 3])
def test_noisy_samples_give_what_weighted_least_squares_gives(radius):
    random = np.random.default_rng(1)
    data, weight = random.normal(0, 1, (ROWS, COLS)), random.uniform(0, 1, (ROWS, COLS))
    weight[weight < 0.2] = 0.0
    fit = fit_quadratics(data, weight, np.ones(data.shape, bool), radius)
    for row, col in [(radius, radius), (10, 11), (ROWS - 1 - radius, 20), (12, COLS - 2)]:
        r, c = (part.ravel() for part in np.mgrid[row - radius : row + radius + 1, col - radius : col + radius + 1])
        within = (c < COLS) & (r < ROWS)
        r, c = r[within], c[within]
        root = np.sqrt(weight[r, c])
        design = np.stack([(c - col) ** p * (r - row) ** q for p, q in POWERS], axis=1) * root[:, None]
        terms, *_ = np.linalg.lstsq(design, data[r, c] * root, rcond=None)
        rest = data[r, c] * root - design @ terms
        np.testing.assert_allclose(fit.terms[row, col], terms, atol=ROUNDING)
        np.testing.assert_allclose(
            fit.variance[row, col], rest @ rest / ((root > 0).sum() - len(POWERS)), atol=ROUNDING
        )


@pytest.mark.parametrize("radius", [2, 6])
@pytest.mark.parametrize("share", [0.02, 0.3])
def test_wanted_samples_alone_have_what_all_samples_would_give_them(radius, share):
    random = np.random.default_rng(3)
    data, weight = random.normal(0, 1, (ROWS, COLS)), random.uniform(0, 1, (ROWS, COLS))
    wanted = random.random(data.shape) < share
    wanted[0] = False
    wanted[-1, [0, -1]] = True
    some, all_of_them = (fit_quadratics(data, weight, which, radius) for which in (wanted, np.ones_like(wanted)))
    for found, expected in zip(some, all_of_them, strict=True):
        np.testing.assert_array_equal(found[wanted], expected[wanted])
        assert np.isnan(found[~wanted]).all()


def test_fits_that_are_replaced_stay_where_no_sample_is_wanted():
    random = np.random.default_rng(4)
    data, weight = random.normal(0, 1, (ROWS, COLS)), random.uniform(0, 1, (ROWS, COLS))
    weight[:8, :8] = 0.0
    everywhere, wanted = np.ones(data.shape, bool), np.zeros(data.shape, bool)
    wanted[:14, 3:20] = True
    wide, narrow = (fit_quadratics(data, weight, everywhere, radius) for radius in (3, 2))
    both = fit_quadratics(data, weight, wanted, 2, replacing=Quadratics(wide.terms.copy(), wide.variance.copy()))
    assert np.isnan(narrow.variance[wanted]).any()
    np.testing.assert_array_equal(both.variance, np.where(wanted, narrow.variance, wide.variance))
    np.testing.assert_array_equal(both.terms, np.where(wanted[..., None], narrow.terms, wide.terms))


@pytest.mark.parametrize("radius", [2, 3])
def test_the_variance_is_that_of_pure_noise(radius):
    random = np.random.default_rng(2)
    sigma = np.where(np.arange(200) < 100, 0.3, 0.9)  # the right half is three times as noisy, and counts for a ninth
    data, weight = random.normal(0, sigma, (200, 200)), np.broadcast_to((0.3 / sigma) ** 2, (200, 200)).copy()
    variance = fit_quadratics(data, weight, np.ones(data.shape, bool), radius).variance
    inner = variance[radius:-radius, radius:-radius]
    assert np.isfinite(inner).all()
    freedoms = inner.size / (2 * radius + 1) ** 2 * ((2 * radius + 1) ** 2 - 6)  # of windows that do not overlap
    assert inner.mean() == pytest.approx(0.09, rel=MAX_STANDARD_ERRORS * np.sqrt(2 / freedoms))


@pytest.mark.parametrize("radius", [2, 3])
def test_the_fit_depends_only_on_ratios_of_weights(radius):
    random = np.random.default_rng(3)
    data, everywhere = random.normal(0, 1, (ROWS, COLS)), np.ones((ROWS, COLS), bool)
    weight = random.uniform(0.5, 1.0, (ROWS, COLS))
    full, tenth = (fit_quadratics(data, share * weight, everywhere, radius) for share in (1.0, 0.1))
    np.testing.assert_allclose(tenth.terms, full.terms, atol=ROUNDING)
    np.testing.assert_allclose(tenth.variance, 0.1 * full.variance, atol=ROUNDING)


def test_the_variance_of_an_exact_quadratic_is_zero_at_any_offset():
    rows, cols = np.indices((ROWS, COLS)).astype(float)
    data = quadratic((1e3, 3.0, -2.0, 0.3, 0.2, -0.1), rows, cols)
    variance = fit_quadratics(data, np.ones(data.shape), np.ones(data.shape, bool), 3).variance
    assert np.nanmax(variance) < EXACT


def test_too_few_samples_give_nan():
    weight = np.zeros((ROWS, COLS))
    weight[:3, :4] = 1.0
    assert weight.sum() == MIN_SAMPLES
    data, everywhere = np.zeros((ROWS, COLS)), np.ones((ROWS, COLS), bool)
    assert np.isfinite(fit_quadratics(data, weight, everywhere, 2).variance[1, 1])
    weight[0, 0] = 0.0
    assert np.isnan(fit_quadratics(data, weight, everywhere, 2).variance).all()


@pytest.mark.parametrize(
    "rows, cols", [(slice(None), slice(10, 12)), (slice(10, 12), slice(None))], ids=["two columns", "two rows"]
)
def test_samples_that_do_not_determine_a_quadratic_give_nan(rows, cols):
    weight = np.zeros((ROWS, COLS))
    weight[rows, cols] = 1.0
    fit = fit_quadratics(np.zeros((ROWS, COLS)), weight, np.ones((ROWS, COLS), bool), 3)
    assert np.isnan(fit.variance).all()
    assert np.isnan(fit.terms).all()


def test_a_window_with_samples_far_from_its_centre_gives_nan():
    weight = np.zeros((ROWS, COLS))
    weight[:, :11] = 1.0
    fit = fit_quadratics(np.zeros((ROWS, COLS)), weight, np.ones((ROWS, COLS), bool), 3)
    assert np.isfinite(fit.variance[12, 10])
    assert np.isnan(fit.variance[12, 12])


def test_only_wanted_samples_are_fitted():
    wanted = np.zeros((ROWS, COLS), bool)
    wanted[4:9, 6:20] = True
    fit = fit_quadratics(np.ones((ROWS, COLS)), np.ones((ROWS, COLS)), wanted, 3)
    np.testing.assert_array_equal(np.isfinite(fit.variance), wanted)


def test_a_window_may_be_asked_to_determine_its_value_better():
    """Three columns at the border: the middle of a full narrow window has half of their leverage."""
    weight = np.zeros((ROWS, COLS))
    weight[:, :8] = 1.0
    strict, lenient = (
        fit_quadratics(np.zeros((ROWS, COLS)), weight, np.ones((ROWS, COLS), bool), 2, leverage=most).variance[12]
        for most in (0.25, 1.0)
    )
    assert np.isfinite(strict[1:7]).all()
    assert np.isnan(strict[[0, 7]]).all()
    assert np.isfinite(lenient[[0, 7]]).all()
