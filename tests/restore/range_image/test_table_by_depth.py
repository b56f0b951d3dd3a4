"""A table is told by depth: a page that stands clear of it, one that touches it, and a surface that has none."""

from importlib import import_module

import numpy as np
import pytest

from restore.range_image.table_by_depth import table_by_depth

PITCH, TOLERANCE = 0.5, 0.2  # mm
SHAPE = (120, 160)
SPECKLES = 20  # single samples whose noise is more than the tolerance


@pytest.fixture
def page():
    area = np.zeros(SHAPE, bool)
    area[30:90, 40:120] = True
    return area


@pytest.fixture
def columns():
    return np.broadcast_to(np.arange(SHAPE[1], dtype=float), SHAPE)


def test_a_page_that_stands_clear_of_all_of_its_table(page):
    found = table_by_depth(np.where(page, 5.0, 0.0), TOLERANCE, PITCH)
    np.testing.assert_array_equal(found.samples, ~page)
    assert (found.clear, found.touching) == (1.0, 0.0)


@pytest.mark.parametrize("high", [1.2, 5.0])
def test_a_shadow_beside_a_page_shows_that_it_ends(page, high):
    """A step of 1.2 mm in one sample is no wall for certain; over a sample that was not measured it is none."""
    height = np.where(page, high, 0.0)
    height[29, 40:120] = np.nan
    found = table_by_depth(height, TOLERANCE, PITCH)
    np.testing.assert_array_equal(found.samples, ~page & np.isfinite(height))
    assert found.clear == pytest.approx(1.0 if high > 1.5 else 80 / 276, abs=0.01)


def test_what_the_page_encloses_is_its_own_and_single_samples_tell_nothing(page):
    height = np.where(page, 5.0, 0.0)
    height[50:60, 70:80] = 0.0
    speckles = np.random.default_rng(0).choice(np.flatnonzero(~page), SPECKLES, replace=False)
    height.flat[speckles] = 2.0 * TOLERANCE
    found = table_by_depth(height, TOLERANCE, PITCH)
    assert not found.samples[page].any()
    assert (~found.samples[~page]).sum() == SPECKLES


@pytest.mark.parametrize("turned", [False, True])
def test_a_strip_on_the_table_from_side_to_side_of_a_page(page, columns, turned):
    """A parabola that touches the table along a line: within the tolerance for 12 mm."""
    height = np.where(page, ((columns - 80.0) / 30.0) ** 2 * 5.0, 0.0)
    if turned:
        height = np.ascontiguousarray(height.T)
    found = table_by_depth(height, TOLERANCE, PITCH)
    np.testing.assert_array_equal(found.samples, ~(page.T if turned else page))


def test_two_pages_beside_each_other_are_not_one(page, columns):
    """10 mm apart, with steps between them."""
    height = np.where(page & (np.abs(columns - 80.0) > 10.0), 5.0, 0.0)
    np.testing.assert_array_equal(table_by_depth(height, TOLERANCE, PITCH).samples, height == 0.0)


def test_a_side_that_lies_on_the_table_is_told(page, columns):
    """One side of four rises from it, by 1 in 20."""
    found = table_by_depth(np.where(page, (columns - 40.0) * PITCH / 20.0 + (columns > 60.0) * 5.0, 0.0), 0.2, PITCH)
    assert 0.15 < found.touching < 0.4


def test_a_surface_that_rises_from_its_own_margin_does_not_stand_clear(columns):
    rows = np.arange(SHAPE[0])[:, None]
    dome = np.clip(20.0 - np.hypot(columns - 80.0, rows - 60.0) * PITCH, 0.0, None)
    assert table_by_depth(dome, TOLERANCE, PITCH).clear == 0.0


@pytest.mark.parametrize("height", [0.0, np.nan])
def test_nothing_above_a_plane(height):
    found = table_by_depth(np.full(SHAPE, height), TOLERANCE, PITCH)
    assert (found.clear, found.touching) == (0.0, 0.0)


def test_compiled_and_plain_python_agree(page, columns, plain):
    height = np.where(page, ((columns - 80.0) / 30.0) ** 2 * 5.0, 0.0)[:60]
    compiled = table_by_depth(height, TOLERANCE, PITCH)
    assert "_contacts" in plain(import_module("restore.range_image.table_by_depth"))
    np.testing.assert_array_equal(table_by_depth(height, TOLERANCE, PITCH).samples, compiled.samples)


def test_where_a_page_leaves_the_picture_it_has_no_outline(page):
    """It goes on over the lower and the right side."""
    beyond = page.copy()
    beyond[30:, 40:] = True
    found = table_by_depth(np.where(beyond, 5.0, 0.0), TOLERANCE, PITCH)
    np.testing.assert_array_equal(found.samples, ~beyond)
    assert (found.clear, found.touching) == (1.0, 0.0)
