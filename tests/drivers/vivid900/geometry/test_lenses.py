"""Optical constants against the tables of the VIVID 910 hardware manual (9222-1888-19)."""

import numpy as np
import pytest

from drivers.vivid900.geometry.lenses import FAST, FINE, LENSES, depth_window, texture_grid
from restore.vivid import TEXTURE_COLS, TEXTURE_ROWS

# p. 26: lens, distance, width and height of the field of view, mm
FIELDS_OF_VIEW = [
    ("TELE", 600, 113.9, 85.4),
    ("TELE", 800, 151.0, 113.2),
    ("TELE", 1000, 188.0, 141.0),
    ("TELE", 1200, 225.1, 168.8),
    ("TELE", 2500, 465.9, 349.4),
    ("MIDDLE", 600, 204.7, 153.6),
    ("MIDDLE", 800, 270.6, 203.0),
    ("MIDDLE", 1000, 336.5, 252.4),
    ("MIDDLE", 1200, 402.4, 301.8),
    ("MIDDLE", 2500, 830.6, 622.9),
    ("WIDE", 600, 367.0, 275.2),
    ("WIDE", 800, 486.6, 364.9),
    ("WIDE", 1000, 606.2, 454.6),
    ("WIDE", 1200, 725.8, 544.4),
    ("WIDE", 2000, 1204.2, 903.2),
]
FIELD_MM = 0.11  # the table is rounded to 0.1 mm and its own heights stray by as much from 3/4 of its widths
DEPTHS_AT_600 = {"TELE": 40.0, "MIDDLE": 70.0, "WIDE": 110.0}  # p. 56, lower end of the Z range
WINDOW_FRACTION = 0.01  # the window is even in 1/depth, not in depth: its ends differ by the square of ±9 %
LINE_NOISE = (0.018, 0.023)  # published precision over the depth of one line is the same for all lenses within this


@pytest.mark.parametrize(("lens", "distance", "width", "height"), FIELDS_OF_VIEW)
def test_field_of_view_is_the_manuals(lens: str, distance: float, width: float, height: float) -> None:
    seen = np.array([TEXTURE_COLS, TEXTURE_ROWS]) / LENSES[lens].focal_px * (distance + LENSES[lens].pupil_mm)
    np.testing.assert_allclose(seen, [width, height], atol=FIELD_MM)


@pytest.mark.parametrize("lens", LENSES)
def test_depth_window_is_the_manuals(lens: str) -> None:
    near, far = depth_window(LENSES[lens], FINE, 600)
    assert far - near == pytest.approx(DEPTHS_AT_600[lens], rel=WINDOW_FRACTION)
    assert near < 600 + LENSES[lens].pupil_mm < far


@pytest.mark.parametrize("lens", LENSES)
def test_fast_measures_less_depth(lens: str) -> None:
    fine, fast = (np.diff(1 / np.array(depth_window(LENSES[lens], mode, 900)))[0] for mode in (FINE, FAST))
    assert fast / fine == pytest.approx(72 / 125)  # lines of the CCD are even in 1/depth


@pytest.mark.parametrize("lens", LENSES)
def test_precision_is_one_fraction_of_a_line_for_every_lens(lens: str) -> None:
    assert LINE_NOISE[0] < LENSES[lens].line_noise < LINE_NOISE[1]


def test_samples_lie_on_texture_pixels() -> None:
    assert texture_grid(FINE).shape == (480, 640, 2)
    assert texture_grid(FAST).shape == (240, 320, 2)
    np.testing.assert_array_equal(texture_grid(FINE)[3, 5], [5, 3])
    np.testing.assert_array_equal(texture_grid(FAST)[3, 5], [10.5, 6.5])  # the middle of pixels 10, 11 and 6, 7
