"""Polygons drawn by hand are checked before they change anything."""

from __future__ import annotations

import numpy as np
import pytest

from restore import BadInput
from restore.edits.polygons import checked_polygon, inside_polygon, within_image

SIZE = (480, 640)
SQUARE = [(10.0, 20.0), (110.0, 20.0), (110.0, 70.0), (10.0, 70.0)]


@pytest.mark.parametrize("points", [SQUARE, SQUARE[::-1]])
def test_a_polygon_holds_what_is_inside_whichever_way_it_runs(points):
    places = np.stack(np.meshgrid(np.arange(640.0), np.arange(480.0)), axis=-1)
    inside = inside_polygon(checked_polygon(points, SIZE, "outline"), places)
    assert inside.sum() == pytest.approx(100 * 50, rel=0.02)
    assert inside[45, 60] and not inside[45, 5]


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
