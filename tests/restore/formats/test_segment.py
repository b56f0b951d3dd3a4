"""Ordered grids of points as meshes."""

from pathlib import Path

import numpy as np
import pytest

from restore.errors import BadInput
from restore.formats.segment import MAX_SEGMENT_POINTS, check_segment, segment_mesh

PATH = Path("a.vcps")


def test_a_lone_point_is_left_out_and_the_rest_keep_their_places():
    rows, cols = np.indices((4, 4))
    points = np.dstack([cols, rows, 0 * rows]).astype(float)
    valid = (rows < 2) & (cols < 2)
    valid[3, 3] = True
    mesh = segment_mesh(PATH, points, valid, None)
    assert mesh.places.tolist() == [0, 1, 4, 5]
    np.testing.assert_array_equal(mesh.vertices, points.reshape(-1, 3)[mesh.places])
    assert mesh.faces.max() == 3


@pytest.mark.parametrize(("rows", "cols"), [(1, 9), (9, 1), (2, MAX_SEGMENT_POINTS)])
def test_a_line_and_a_grid_larger_than_any_are_refused(rows, cols):
    with pytest.raises(BadInput, match=r"a\.vcps"):
        check_segment(PATH, rows, cols)
