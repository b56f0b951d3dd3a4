"""Gaps in rows, found by whole arrays, are those that a loop from sample to sample meets."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from restore.range_image.border import _gaps_at_border, _steep_gaps
from restore.range_image.gaps import gaps_of_rows
from restore.range_image.segmentation.segment import MAX_LOST, _interpolated

SHAPE = 4, 3 * MAX_LOST
STEP = 0.1  # of the depth, for each sample
MASKS = arrays(bool, SHAPE)
DEPTHS = arrays(float, SHAPE, elements=st.sampled_from([10.0, 11.0, 12.0, 14.0, 20.0]))


def gaps(measured):
    """Row by row the last sample before each gap, and the first behind it."""
    for row, cells in enumerate(measured):
        last = None
        for col in np.flatnonzero(cells):
            if last is not None and col > last + 1:
                yield row, last, col
            last = col


@given(MASKS)
def test_a_gap_has_a_sample_on_either_side_of_it_in_its_row(measured):
    found = np.transpose(gaps_of_rows(measured))
    wanted = [[row * SHAPE[1] + last, row * SHAPE[1] + col] for row, last, col in gaps(measured)]
    np.testing.assert_array_equal(found, np.reshape(wanted, (-1, 2)))


@given(DEPTHS, MASKS)
def test_over_a_steep_gap_depth_changes_by_the_step_for_each_of_its_samples(depth, measured):
    wanted = np.zeros(SHAPE, bool)
    for row, last, col in gaps(measured):
        change = abs(depth[row, col] - depth[row, last])
        wanted[row, last + 1 : col] = change >= STEP * (col - last) * depth[row, last]
    np.testing.assert_array_equal(_steep_gaps(depth, measured, STEP), wanted)


@given(MASKS, MASKS, MASKS)
def test_a_wide_gap_at_the_edge_of_the_sheet_counts_unless_a_shadow_lies_in_it(measured, inside, shadow):
    wanted = 0
    for row, last, col in gaps(measured):
        leads = col - last > MAX_LOST and inside[row, last] != inside[row, col]
        wanted += leads and not shadow[row, last + 1 : col].any()
    assert _gaps_at_border(measured, inside, shadow) == wanted


@pytest.mark.parametrize("longest", [1, 3])
@given(DEPTHS, MASKS, MASKS)
def test_a_short_gap_between_samples_of_one_surface_is_filled_evenly(longest, depth, samples, measured):
    samples = samples & measured
    wanted = np.full(SHAPE, np.nan)
    for row, last, col in gaps(measured):
        change = (depth[row, col] - depth[row, last]) / (col - last)
        one_surface = samples[row, last] and samples[row, col] and abs(change) < STEP * depth[row, last]
        if col - last <= longest + 1 and one_surface:
            for k in range(1, col - last):
                wanted[row, last + k] = depth[row, last] + k * change
    np.testing.assert_array_equal(_interpolated(depth, samples, measured, longest, STEP), wanted)
