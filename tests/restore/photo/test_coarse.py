"""Wide blurs in smaller copies are those of the full size; what is seen flat is not resolved."""

import cv2
import numpy as np
import pytest

from restore.photo.coarse import Placed, blurred_widely

SHAPE = (233, 331)
ALIKE = 0.01  # of the range: what the average over a pixel of the copy and the interpolation between two add


@pytest.mark.parametrize("channels", [(), (3,)])
@pytest.mark.parametrize("sigma", [4.0, 9.4, 29.5, 70.9])
def test_a_wide_blur_is_that_of_the_full_size(sigma, channels):
    values = np.zeros((*SHAPE, *channels))
    values[60:170, 90:200] = 1.0
    exact = cv2.GaussianBlur(values, (0, 0), sigma)
    found = blurred_widely(values, sigma)
    assert found.shape == exact.shape
    assert np.abs(found - exact).max() < ALIKE * np.ptp(exact)


def test_an_even_field_stays_even():
    np.testing.assert_allclose(blurred_widely(np.full(SHAPE, 0.7), 40.0), 0.7, rtol=1e-6)


@pytest.mark.parametrize("turn_deg", [0.0, 30.0, 90.0])
def test_a_wall_that_is_seen_flat_is_not_resolved(turn_deg):
    """Its left half faces the camera, its right half is a fifth as wide in the picture, whichever way it runs."""
    across = np.where(np.arange(200) < 100, 8.0, 1.6)
    x, y = np.meshgrid(np.cumsum(across), 8.0 * np.arange(100))
    turn = np.radians(turn_deg)
    pixels = np.stack([x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)], axis=-1)
    placed = Placed.at(np.zeros((900, 1000, 3), np.uint8), pixels, x < across[:100].sum())
    assert placed.resolved[:, :98].all()
    assert not placed.resolved[:, 102:].any()
