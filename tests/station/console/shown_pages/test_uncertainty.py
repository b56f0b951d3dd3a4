"""The colours of the uncertainty."""

from __future__ import annotations

import numpy as np
import pytest

from station.console.shown_pages.strain import OPACITY, end_of_scale
from station.console.shown_pages.uncertainty import draw_uncertainty
from station.pictures.strain import UNSIGNED


def test_the_ends_of_the_scale_have_the_ends_of_the_colours():
    values = np.array([[0.0, 0.01, 0.05, np.nan]])
    picture = draw_uncertainty(values)
    assert end_of_scale(values) == pytest.approx(0.05)
    assert picture[0, [0, 2], :3].tolist() == UNSIGNED[[0, -1]].astype(int).tolist()
    assert picture[0, :, 3].tolist() == [OPACITY, OPACITY, OPACITY, 0]


def test_what_is_beyond_the_scale_has_its_last_colour():
    values = np.full((20, 20), 0.001)
    values[0, 0] = 1.0  # a single corner
    assert end_of_scale(values) == pytest.approx(0.001)
    assert (draw_uncertainty(values)[..., :3] == UNSIGNED[-1].astype(int)).all()


def test_a_page_without_values_is_transparent():
    assert not draw_uncertainty(np.full((3, 4), np.nan))[..., 3].any()
