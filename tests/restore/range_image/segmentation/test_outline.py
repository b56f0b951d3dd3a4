"""The outline of a page: clear of the table by a step or a shadow, touching it, or gone at the frame of the picture."""

import numpy as np
import pytest

from restore.range_image.segmentation.outline import is_enclosed, is_sheet, lies_above, outline_of, page_on
from restore.range_image.segmentation.plane import TablePlane

PITCH, TOLERANCE = 0.5, 0.2  # mm
SHAPE = (120, 160)


def outline_above(height, page):
    table, plane = ~page & np.isfinite(height), TablePlane(height, TOLERANCE, PITCH)
    return outline_of(page_on(table, plane), table, plane)


def test_a_page_that_stands_clear_of_all_of_its_table(page):
    assert outline_above(np.where(page, 5.0, 0.0), page) == (1.0, 0.0)
    assert is_enclosed(page, np.ones(SHAPE, bool))


@pytest.mark.parametrize("high", [0.5, 1.2, 5.0])
@pytest.mark.parametrize("lost", [0, 1, 3])
def test_a_page_ends_by_a_step_whether_or_not_samples_are_lost_there(page, high, lost):
    height = np.where(page, high, 0.0)
    height[30 - lost : 30, 40:120] = np.nan
    assert outline_above(height, page).clear == pytest.approx(1.0, abs=0.01)


def test_without_measured_neighbours_a_page_has_no_outline(page, columns):
    """A page of which the left half lies in a plane and the right half rises, before a scene that is out of depth."""
    height = np.where(page, np.maximum(columns - 80.0, 0.0) * PITCH, np.nan)
    found = outline_above(height, page & (columns > 80.0))
    assert (found.clear, found.touching) == (0.0, 1.0)


@pytest.mark.parametrize("measured", [0.05, 0.2, 1.0])
def test_a_table_of_which_little_is_measured_is_still_below_the_page(page, measured):
    """As on black cloth; the next sample on it is as far from a page that touches it as from one that does not."""
    lost = ~page & (np.random.default_rng(5).random(SHAPE) > measured)
    assert outline_above(np.where(lost, np.nan, np.where(page, 6.0, 0.0)), page).clear > 0.6
    assert outline_above(np.where(lost, np.nan, np.where(page, 0.1, 0.0)), page).clear == 0.0


def test_a_side_that_lies_on_the_table_is_reported(page, columns):
    """One side of four rises from it, by 1 in 20."""
    height = np.where(page, (columns - 40.0) * PITCH / 20.0 + (columns > 60.0) * 5.0, 0.0)
    assert 0.15 < outline_above(height, page).touching < 0.4


@pytest.mark.parametrize("slope_deg", [20.0, 60.0, 80.0])
@pytest.mark.parametrize("lost", [0.0, 0.5])
def test_a_surface_that_rises_from_its_own_margin_does_not_stand_clear(columns, slope_deg, lost):
    """A cone, and half of its samples lost, as in print."""
    rows = np.arange(SHAPE[0])[:, None]
    cone = np.clip(20.0 - np.hypot(columns - 80.0, rows - 60.0) * PITCH, 0.0, None) * np.tan(np.radians(slope_deg))
    height = np.where(np.random.default_rng(7).random(SHAPE) < lost, np.nan, cone)
    assert outline_above(height, cone > TOLERANCE).clear < 0.02


def test_where_a_page_leaves_the_picture_it_has_no_outline(page):
    """It goes on over the lower and the right side."""
    page[30:, 40:] = True
    assert outline_above(np.where(page, 5.0, 0.0), page) == (1.0, 0.0)
    assert not is_enclosed(page, np.ones(SHAPE, bool))


def test_the_picture_ends_where_its_samples_do(page):
    """The scanner lost the rows and columns beyond two sides of the page."""
    measured = np.ones(SHAPE, bool)
    measured[90:] = measured[:, 120:] = False
    assert not is_enclosed(page, measured)


def test_a_sheet_is_one_piece_of_a_twentieth_of_the_samples(page, columns):
    measured = np.ones(SHAPE, bool)
    assert is_sheet(page, measured)
    assert not is_sheet(page & (columns % 8 < 2), measured), "lines"
    assert not is_sheet(page & (columns > 110), measured), "small"


def test_a_sheet_goes_on_where_samples_were_lost(page):
    measured = np.random.default_rng(2).random(SHAPE) > 0.6
    assert is_sheet(page & measured, measured)


def test_nothing_is_found_next_to_a_table():
    assert outline_above(np.zeros(SHAPE), np.zeros(SHAPE, bool)) == (0.0, 0.0)


@pytest.mark.parametrize(("thickness_mm", "above"), [(0.0, False), (0.02, False), (0.1, True), (-0.1, False)])
def test_a_flat_page_is_as_high_above_its_table_as_paper_is_thick(page, columns, thickness_mm, above):
    """On a table bowed by half a millimetre, with a third of the tolerance for noise."""
    random = np.random.default_rng(9)
    bowed = 0.5 * ((columns - 80.0) / 80.0) ** 2
    height = bowed + np.where(page, thickness_mm, 0.0) + random.normal(0.0, TOLERANCE / 3.0, SHAPE)
    plane = TablePlane(height, 1.0, PITCH)
    assert lies_above(page, ~page, plane) == above
    few = page & (columns < 44)
    assert not lies_above(few & (np.arange(SHAPE[0])[:, None] < 40), ~page, plane), "too few samples"
