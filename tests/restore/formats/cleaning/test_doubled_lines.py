"""Rows and columns that a segment has twice."""

import numpy as np
import pytest

from restore.formats.cleaning.doubled_lines import without_doubled_lines

ROWS, COLS = 12, 17


@pytest.fixture
def segment(rng):
    """Points of a curved sheet, all valid but a corner."""
    row, col = np.mgrid[:ROWS, :COLS].astype(float)
    points = np.stack([20.0 * col, 20.0 * row, 9.0 * np.sin(col / 4.0)], axis=-1) + rng.normal(0, 0.1, (ROWS, COLS, 3))
    valid = np.ones((ROWS, COLS), bool)
    valid[:3, :4] = False
    return points, valid


def test_a_sound_segment_stays_as_it_is(segment):
    found, valid, _, findings = without_doubled_lines(*segment, None)
    np.testing.assert_array_equal(found, segment[0])
    np.testing.assert_array_equal(valid, segment[1])
    assert findings == []


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize(("from_line", "to_lines"), [(5, [6]), (6, [5]), (5, [6, 7])])
def test_a_line_written_over_others_is_filled_in(segment, axis, from_line, to_lines):
    points = np.moveaxis(segment[0].copy(), axis, 0)
    points[to_lines] = points[from_line]
    broken = np.moveaxis(points, 0, axis)
    found, _, _, findings = without_doubled_lines(broken, segment[1], None)
    assert np.abs(found - segment[0])[segment[1]].max() < 2.0  # of a link of 20: what bends between two lines
    assert np.abs(broken - segment[0])[segment[1]].max() > 19.0
    (said,) = (one.text for one in findings)
    assert f"{len(to_lines)} interpolated" in said


@pytest.mark.parametrize("axis", [0, 1])
def test_a_line_too_many_is_left_out_with_its_part_of_the_picture(segment, axis):
    places = np.stack(np.meshgrid(np.arange(COLS), np.arange(ROWS)), axis=-1).astype(float)
    broken = [np.insert(values, 6, np.take(values, 5, axis), axis) for values in (*segment, places)]
    found, valid, where, findings = without_doubled_lines(*broken)
    np.testing.assert_array_equal(found, segment[0])
    np.testing.assert_array_equal(valid, segment[1])
    np.testing.assert_array_equal(where, places)
    assert "1 skipped" in findings[0].text
