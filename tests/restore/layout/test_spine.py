"""The deepest valley of a tilt map is placed where its walls meet."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restore.layout.spine import BANDS, PER_MM, find_spine, tilt_map, turns_of

HEIGHT, WIDTH = 120, 400  # pixels: 60 × 200 mm
HALF_PIXEL_MM = 0.5 / PER_MM


def book(spine_mm, left_deg=40.0, right_deg=50.0, reach_mm=25.0):
    """The tilt map (h, w) of an opened book whose walls fall off exponentially."""
    x = (np.arange(WIDTH) + 0.5) / PER_MM - spine_mm
    wall = np.where(x < 0, left_deg * np.exp(x / reach_mm), -right_deg * np.exp(-x / reach_mm))
    return np.tile(np.radians(wall), (HEIGHT, 1))


@given(st.floats(30, 170), st.floats(8, 65), st.floats(8, 65))
def test_a_spine_is_where_the_walls_meet(spine_mm, left_deg, right_deg):
    spine = find_spine(book(spine_mm, left_deg, right_deg))
    np.testing.assert_allclose(spine.place[:, 0], spine_mm, atol=2 * HALF_PIXEL_MM)
    assert spine.bands == 1.0
    assert spine.turn_deg < 0.5 * -(left_deg + right_deg) < 0 < spine.beyond_deg


def test_a_leaning_spine_leans():
    tilt = np.stack([book(100.0 + 0.05 * row / PER_MM)[0] for row in range(HEIGHT)])
    assert find_spine(tilt).lean_deg == pytest.approx(np.degrees(np.arctan(0.05)), abs=0.2)


def test_the_panels_of_a_card_do_not_arch_back():
    spine = find_spine(book(100.0, reach_mm=1e6))
    assert (spine.turn_deg, spine.beyond_deg) == (pytest.approx(-90.0, abs=0.01), pytest.approx(0.0, abs=0.01))


def test_a_ridge_is_not_a_spine():
    assert find_spine(-book(100.0)).turn_deg > -25.0  # of the arches on its sides
    assert find_spine(np.full((HEIGHT, WIDTH), np.nan)) is None


def test_turns_are_those_of_the_windows():
    profile = np.tile(np.repeat([1.0, -2.0], WIDTH // 2), (BANDS, 1))
    turns = turns_of(profile, 4.0)
    assert turns[:, WIDTH // 2] == pytest.approx(-3.0)
    assert np.isnan(turns[:, 0]).all()
    assert np.nanmin(turns) == pytest.approx(-3.0)


def test_the_tilt_is_the_angle_to_the_right():
    angle = np.radians([-30.0, 0.0, 30.0])
    normals = np.stack([np.sin(angle), np.zeros(3), np.cos(angle)], axis=1)[None].astype(np.float32)
    np.testing.assert_allclose(tilt_map(normals, np.array([0.0, 2.0, 0.0])), angle[None], atol=1e-6)
