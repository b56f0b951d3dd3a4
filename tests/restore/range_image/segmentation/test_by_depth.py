"""A table is told by depth: below a page that stands clear of it, and one that touches it."""

from importlib import import_module

import numpy as np
import pytest

from restore.range_image.segmentation.by_depth import table_by_depth
from restore.range_image.segmentation.plane import TablePlane

PITCH, TOLERANCE = 0.5, 0.2  # mm
SHAPE = (120, 160)
SPECKLES = 20  # single samples whose noise is more than the tolerance


def table_below(height):
    return table_by_depth(TablePlane(height, TOLERANCE, PITCH))


def test_all_of_the_plane_round_a_page(page):
    np.testing.assert_array_equal(table_below(np.where(page, 5.0, 0.0)), ~page)


def test_what_the_page_encloses_is_its_own_and_single_samples_say_nothing(page):
    height = np.where(page, 5.0, 0.0)
    height[50:60, 70:80] = 0.0
    speckles = np.random.default_rng(0).choice(np.flatnonzero(~page), SPECKLES, replace=False)
    height.flat[speckles] = 2.0 * TOLERANCE
    table = table_below(height)
    assert not table[page].any()
    assert (~table[~page]).sum() == SPECKLES


@pytest.mark.parametrize("turned", [False, True])
def test_a_strip_on_the_table_from_side_to_side_of_a_page(page, columns, turned):
    """A parabola that touches the table along a line: within the tolerance for 12 mm."""
    height = np.where(page, ((columns - 80.0) / 30.0) ** 2 * 5.0, 0.0)
    if turned:
        height = np.ascontiguousarray(height.T)
    np.testing.assert_array_equal(table_below(height), ~(page.T if turned else page))


def test_two_pages_side_by_side_are_not_one(page, columns):
    """10 mm apart, with steps between them."""
    height = np.where(page & (np.abs(columns - 80.0) > 10.0), 5.0, 0.0)
    np.testing.assert_array_equal(table_below(height), height == 0.0)


def test_nothing_above_a_plane_is_not_a_page(page):
    """Nor is what lies below it, nor a sheet smaller than 5 % of the samples."""
    small = np.zeros(SHAPE, bool)
    small[30:50, 40:60] = True
    for height in (np.zeros(SHAPE), np.where(page, -5.0, 0.0), np.where(small, 5.0, 0.0), np.full(SHAPE, np.nan)):
        assert table_below(height) is None


def test_compiled_and_plain_python_agree(page, columns, plain):
    height = np.where(page, ((columns - 80.0) / 30.0) ** 2 * 5.0, 0.0)[:60]
    compiled = table_below(height)
    assert "_contacts" in plain(import_module("restore.range_image.segmentation.by_depth"))
    np.testing.assert_array_equal(table_below(height), compiled)
