"""Lenses: tangents and pixels are inverse to each other; grids of lines of sight cover the picture evenly."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from restore.structured_light import Lens
from restore.structured_light.grid import SAMPLES, view_grid

INVERSE_PX = 1e-5  # ten times what the undistortion is iterated to
SIZE = (800, 600)
GRID_ROUNDING = 1e-12  # of tangents


def lens(k1=0.06, k2=-0.11, p1=4e-4, p2=-3e-4, k3=0.05):
    return Lens(np.array([[900.0, 0, 405], [0, 890.0, 296], [0, 0, 1]]), np.array([k1, k2, p1, p2, k3]))


@settings(max_examples=25, deadline=None)
@given(k1=st.floats(-0.2, 0.2), k2=st.floats(-0.1, 0.1), p1=st.floats(-1e-3, 1e-3))
def test_pixels_of_tangents_are_the_pixels(k1, k2, p1):
    one = lens(k1=k1, k2=k2, p1=p1, k3=0.0)
    pixels = np.array([[0.0, 0.0], [799, 0], [400, 300], [799, 599], [12, 587]])
    np.testing.assert_allclose(one.pixels(one.tangents(pixels)), pixels, atol=INVERSE_PX)


def test_a_grid_is_even_in_tangents_and_reaches_the_corners():
    grid = view_grid(lens(), SIZE)
    steps = np.diff(grid.tangents[0, :, 0])
    np.testing.assert_allclose(steps, steps[0], atol=GRID_ROUNDING)
    assert np.ptp(grid.pixels[..., 0]) > SIZE[0] - 1 - 2 * grid.spacing
    assert abs(grid.tangents[..., 0].size - SAMPLES) < 0.2 * SAMPLES  # distortion makes its view larger or smaller
    pixels, tangents = (field[100:102].reshape(-1, 2) for field in (grid.pixels, grid.tangents))
    np.testing.assert_allclose(lens().tangents(pixels), tangents, atol=INVERSE_PX / 890)


def test_a_small_picture_has_one_sample_to_a_pixel():
    one = Lens(np.array([[200.0, 0, 79.5], [0, 200.0, 59.5], [0, 0, 1]]), np.zeros(5))
    grid = view_grid(one, (160, 120))
    assert grid.spacing == 1.0
    assert grid.tangents.shape == (120, 160, 2)
    assert view_grid(one, (160, 120), 2.5).tangents.shape == (49, 65, 2)
