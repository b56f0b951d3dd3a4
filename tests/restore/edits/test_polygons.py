"""Polygons drawn by hand are checked before they change anything."""

from __future__ import annotations

import numpy as np
import pytest

from restore import BadInput
from restore.edits.polygons import checked_polygon, within_image

SIZE = (480, 640)


@pytest.mark.parametrize(
    ("points", "reason"),
    [
        ([(10, 10), (100, 100), (100, 10), (10, 100)], "side 0 meets side 2"),
        ([(10, 10), (20, 10), (30, 10)], "no area"),
        ([(-50, 10), (100, 10), (100, 100)], "outside the image"),
        ([(10, 10), (100, 10), (100, 900)], "outside the image"),
    ],
)
def test_others_are_refused(points, reason):
    with pytest.raises(BadInput, match=reason):
        checked_polygon(points, SIZE, "outline")


def test_a_slip_of_the_hand_is_moved_to_the_edge():
    np.testing.assert_array_equal(within_image(np.array([[-5.0, 490.0]]), SIZE, "spine"), [[0.0, 479.0]])
