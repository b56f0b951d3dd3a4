"""The bias of quadratics' slopes is taken off: exactly on cubics, nearly on waves, and nowhere else."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from restore.range_image.facets.facet_model import WIDE_RADIUS, in_whole_windows
from restore.range_image.facets.quadratic_fit import fit_quadratics
from restore.range_image.facets.slope_statistics import unbiased
from restore.range_image.facets.tangent_fit import ALL_POWERS

ROWS, COLS = 50, 60
APART = 2 * WIDE_RADIUS + 1  # samples from a window to the next that has no sample of it
EVERYWHERE = np.ones((ROWS, COLS), bool)
SOUND = in_whole_windows(np.pad(EVERYWHERE, 1))[1:-1, 1:-1]
REACH = APART + WIDE_RADIUS + WIDE_RADIUS + 2  # samples from the border: a window away from the mean of sound slopes
SMALLEST = 1e-9  # slopes that are all smaller are 0
EXACT = 1e-6  # of the greatest slope: rounding of the fit
WAVELENGTH = 60.0  # samples: 28 mm on a page that fills the picture
LEFT = 0.1  # of the bias on such a wave: the fifth derivatives


def quadratic_slopes(data):
    return fit_quadratics(data, np.ones(data.shape), EVERYWHERE, WIDE_RADIUS).terms[..., 1:3]


def inner(values):
    return values[REACH:-REACH, REACH:-REACH]


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=10, max_size=10))
def test_cubics_have_their_own_slopes(terms):
    rows, cols = (grid / 20.0 - 1.0 for grid in np.indices((ROWS, COLS)).astype(float))
    data = sum(f * cols**p * rows**q for f, (p, q) in zip(terms, ALL_POWERS, strict=True))
    across = sum(f * p * cols ** max(p - 1, 0) * rows**q for f, (p, q) in zip(terms, ALL_POWERS, strict=True)) / 20.0
    down = sum(f * q * cols**p * rows ** max(q - 1, 0) for f, (p, q) in zip(terms, ALL_POWERS, strict=True)) / 20.0
    found = unbiased(quadratic_slopes(data), SOUND)
    scale = np.abs(across).max() + np.abs(down).max() + SMALLEST
    np.testing.assert_allclose(inner(found), inner(np.stack([across, down], axis=-1)), atol=EXACT * scale)


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 90.0])
def test_of_the_bias_on_a_wave_hardly_any_is_left(angle_deg):
    rows, cols = np.indices((ROWS, COLS)).astype(float)
    wave = 2 * np.pi / WAVELENGTH * np.array([np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))])
    phase = wave[0] * cols + wave[1] * rows
    slopes = quadratic_slopes(np.sin(phase))
    true = wave * np.cos(phase)[..., None]
    assert np.abs(inner(unbiased(slopes, SOUND) - true)).max() < LEFT * np.abs(inner(slopes - true)).max()


def test_slopes_near_what_is_not_known_stay_as_they_are():
    cols = np.broadcast_to(np.arange(float(COLS)), (ROWS, COLS))
    slopes = quadratic_slopes(np.sin(cols / 9.0))
    sound = SOUND.copy()
    sound[:, 28:32] = False
    found = unbiased(slopes, sound)
    changed = (found != slopes)[25, :, 0]
    margin = 2 * WIDE_RADIUS + 1 + APART  # a whole window of sound slopes, a window away
    assert changed[margin : 28 - margin + WIDE_RADIUS + 1].all()
    assert not changed[28 - APART - WIDE_RADIUS : 32 + APART + WIDE_RADIUS].any()
    assert not changed[:margin].any()


def test_a_page_narrower_than_three_windows_stays_as_it_is():
    slopes = np.random.default_rng(0).normal(size=(3 * APART - 8, 9, 2))
    np.testing.assert_array_equal(unbiased(slopes, np.ones(slopes.shape[:2], bool)), slopes)
