"""Places within polygons, whichever way these run."""

from __future__ import annotations

import numpy as np
import pytest

from restore.numerics.polygons import inside_polygon

SQUARE = np.array([(10.0, 20.0), (110.0, 20.0), (110.0, 70.0), (10.0, 70.0)])


@pytest.mark.parametrize("corners", [SQUARE, SQUARE[::-1]])
def test_a_polygon_holds_the_pixels_inside(corners):
    inside = inside_polygon(np.stack(np.meshgrid(np.arange(640.0), np.arange(480.0)), axis=-1), corners)
    assert inside.sum() == pytest.approx(100 * 50, rel=0.02)
    assert inside[45, 60] and not inside[45, 5]


def test_places_within_a_polygon():
    corners = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [5.0, 2.0], [0.0, 10.0]])
    places = np.array([[1.0, 5.0], [5.0, 1.0], [5.0, 5.0], [9.5, 8.0], [-1.0, 5.0], [11.0, 5.0], [5.0, -1.0]])
    assert inside_polygon(places, corners).tolist() == [True, True, False, True, False, False, False]
    assert inside_polygon(places, corners[::-1]).tolist() == inside_polygon(places, corners).tolist()
