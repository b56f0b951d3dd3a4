"""Triangles of an ordered grid."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from restore.mesh.measures import signed_areas
from restore.mesh.ordered_grid import grid_faces


def places(valid):
    """(n, 2) columns to the right and rows down of the valid points, as flat positions with y up."""
    rows, cols = np.nonzero(valid)
    return np.column_stack([cols, -rows]).astype(float)


def test_a_whole_cell_has_two_triangles_and_one_of_three_corners_one():
    valid = np.array([[True, True, False], [True, True, True]])
    assert grid_faces(valid).tolist() == [[0, 2, 3], [0, 3, 1], [2 - 1, 3, 4]]


@settings(max_examples=50, deadline=None)
@given(arrays(bool, array_shapes(min_dims=2, max_dims=2, max_side=7), elements=st.booleans()))
def test_every_cell_is_covered_once_with_its_orientation(valid):
    faces = grid_faces(valid)
    corners = np.zeros(np.maximum(np.array(valid.shape) - 1, 0), int)
    for down in (0, 1):
        for right in (0, 1):
            corners += valid[down : down + corners.shape[0], right : right + corners.shape[1]]
    assert len(faces) == (corners == 3).sum() + 2 * (corners == 4).sum()
    if len(faces):
        np.testing.assert_array_equal(signed_areas(places(valid), faces), 0.5)
