"""The error of a layout is that of its pixels, and shows a page that is laid out wrongly."""

import numpy as np
import pytest

from drivers.simulated import Flat, shoot
from oracles.layout import layout_error
from restore import Settings, restore

PIXELS = 100_000
FLAT_MM = 0.05  # a flat page in FAST mode is about half as far off


@pytest.mark.slow
def test_the_layout_of_a_page_is_compared_pixel_by_pixel():
    scan, truth = shoot(Flat(), seed=1, mode="fast")
    page = restore(scan, Settings(dpi=100))
    error = np.linalg.norm(layout_error(page, scan, truth), axis=1)
    assert len(error) > PIXELS
    assert np.sqrt((error**2).mean()) < FLAT_MM
    shifted = page.with_pictures(page_map=page.page_map + np.linspace(0, 4, page.page_map.shape[1])[None, :, None])
    assert np.sqrt((layout_error(shifted, scan, truth) ** 2).sum(axis=1).mean()) > 10 * FLAT_MM
