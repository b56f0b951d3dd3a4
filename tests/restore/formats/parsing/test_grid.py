"""Range grids: limits, the place of samples in the picture, and the polygons between neighbours."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restore.errors import BadInput
from restore.formats.parsing.grid import check_grid, grid_polygons, samples_in_picture
from restore.formats.parsing.source import MAX_SAMPLES

FILE = Path("page.cdm")


@pytest.mark.parametrize(("rows", "cols"), [(0, 5), (5, 0), (-1, -1), (MAX_SAMPLES, 2)])
def test_a_grid_without_samples_or_beyond_every_scanner_is_refused(rows, cols):
    with pytest.raises(BadInput, match=r"page\.cdm"):
        check_grid(FILE, rows, cols)
    check_grid(FILE, 480, 640)


def test_a_sample_lies_in_the_middle_of_its_pixels():
    fine = samples_in_picture(FILE, 480, 640, np.zeros((480, 640, 3), np.uint8))
    np.testing.assert_array_equal(fine, samples_in_picture(FILE, 480, 640, None))
    np.testing.assert_array_equal(fine[7, 11], [11, 7])
    fast = samples_in_picture(FILE, 240, 320, np.zeros((480, 640, 3), np.uint8))
    np.testing.assert_array_equal(fast[0, 0], [0.5, 0.5])
    np.testing.assert_array_equal(fast[-1, -1], [638.5, 478.5])


def test_a_picture_of_another_shape_is_refused_with_the_option_to_give():
    with pytest.raises(BadInput, match="does not fit") as refused:
        samples_in_picture(FILE, 480, 640, np.zeros((640, 480, 3), np.uint8))
    assert "--texture" in refused.value.hint


@given(st.integers(0, 2**20 - 1))
def test_polygons_join_measured_neighbours_counter_clockwise_and_cover_each_cell_once(bits):
    measured = np.array([bits >> k & 1 for k in range(20)], bool).reshape(4, 5)
    quads, triangles = grid_polygons(measured)
    rows, cols = np.nonzero(measured)
    position = np.stack([cols, -rows], axis=1).astype(float)  # x right, y up, as the scanner sees them
    cells = sum(measured[a : a + 3, b : b + 4].astype(int) for a, b in [(0, 0), (0, 1), (1, 0), (1, 1)])
    assert (len(quads), len(triangles)) == ((cells == 4).sum(), (cells == 3).sum())
    for polygons, area in ((quads, 1.0), (triangles, 0.5)):
        corners = position[polygons]
        x, y = corners[..., 0], corners[..., 1]
        doubled = (x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1)
        np.testing.assert_array_equal(doubled, 2 * area)
