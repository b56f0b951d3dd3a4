"""Wide blurs in smaller copies are those of the full size."""

import cv2
import numpy as np
import pytest

from restore.photo.coarse import blurred_widely

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
