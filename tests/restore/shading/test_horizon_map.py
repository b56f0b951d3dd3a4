"""Horizons of ridges, valleys and planes against their slopes in closed form (Max 1988)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restore.shading.horizon_map import AZIMUTHS, NOWHERE, fill_nearest, horizon_map, in_sight
from restore.shading.relief import Relief

HALF_MM = 100.0  # of the square page
# The steps along a ray grow by a tenth, so the rim is met up to a tenth of its distance early: its slope there is less
# by no more than that, and never more than the true one.
GROWTH_FRACTION = 0.1
ABOVE = 1e-3  # tangent: bilinear interpolation on facets is exact to single precision
SLOPE = 0.5


def relief(height, half=HALF_MM, cells=80):
    """A page whose height (n,) mm over (n, 2) mm is given; points and normals are not asked for here."""
    xy = np.stack(np.meshgrid(*[np.linspace(-half, half, cells + 1)] * 2), axis=-1).reshape(-1, 2)
    number = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    nothing = np.zeros((1, 1, 3), np.float32)
    vertices = np.column_stack([xy, height(xy)])
    return Relief(nothing, nothing, 25.4, vertices, faces, np.eye(3), np.zeros(3))


@pytest.fixture(scope="module")
def valley():
    return horizon_map(relief(lambda xy: SLOPE * np.abs(xy[:, 0])))


@pytest.fixture(scope="module")
def plane():
    return horizon_map(relief(lambda xy: 0 * xy[:, 0]))


def at(found, x, y):
    col, row = found.nodes(np.array([x, y, 0.0], np.float32))
    return found.slopes[round(float(row)), round(float(col))]


def test_on_a_plane_nothing_rises_and_all_the_light_arrives(plane):
    assert plane.slopes.max() < ABOVE  # past the border of the page they are far below
    assert plane.openness.min() > 1 - ABOVE


def test_nodes_are_where_their_coordinates_say(plane):
    nodes = plane.nodes(np.array([[-HALF_MM, HALF_MM, 0.0], [-HALF_MM + plane.pitch, HALF_MM, 0.0]], np.float32))
    np.testing.assert_allclose(nodes, [[0, 0], [1, 0]], atol=1e-4)
    np.testing.assert_allclose(plane.heights[plane.heights != NOWHERE], 0.0, atol=1e-4)


@pytest.mark.parametrize("x", [-60.0, -30.0, -10.0])
def test_across_a_valley_the_horizon_is_the_far_rim(valley, x):
    """The rim is SLOPE·HALF_MM high: from x ≤ 0 it rises by SLOPE·(HALF_MM − |x|) over HALF_MM + |x|."""
    rim = SLOPE * (HALF_MM - abs(x)) / (HALF_MM + abs(x))
    assert (
        (1 - GROWTH_FRACTION) * rim - SLOPE * GROWTH_FRACTION < at(valley, x, 0.0)[0] < rim + 0.01
    )  # half a node of x
    # Towards the own rim the plane itself is the horizon.
    assert at(valley, x, 0.0)[AZIMUTHS // 2] == pytest.approx(SLOPE, abs=0.01)


def test_between_azimuths_a_slope_falls_as_the_cosine(valley):
    slopes = at(valley, -50.0, 0.0)
    for k in range(AZIMUTHS):
        towards_own_rim = -np.cos(2 * np.pi * k / AZIMUTHS)
        if towards_own_rim > 0.5:
            assert slopes[k] == pytest.approx(SLOPE * towards_own_rim, abs=0.01)


def test_a_lamp_is_seen_above_the_horizon_and_not_below_it(valley):
    col, row = (float(part) for part in valley.nodes(np.array([-50.0, 0.0, 0.0], np.float32)))
    horizon = float(at(valley, -50.0, 0.0)[0])
    seen = [in_sight(valley.slopes, col, row, 1.0, 0.0, horizon + off) for off in (-0.2, 0.2)]
    assert seen == [0.0, 1.0]
    assert in_sight(valley.slopes, col, row, 0.0, 0.0, 1.0) == 1.0


def test_the_bottom_of_a_valley_gets_less_light_than_its_rim(valley):
    openness = valley.openness
    middle, (_, cols) = openness.shape[0] // 2, openness.shape
    assert openness[middle, cols // 2] < openness[middle, cols // 8]
    assert openness.min() > 0
    assert openness.max() <= 1


@given(st.integers(0, 2**20 - 1))
def test_unknown_places_take_a_nearest_known_value(bits):
    known = np.array([bits >> k & 1 for k in range(20)], bool).reshape(4, 5)
    field = np.arange(20.0).reshape(4, 5)
    filled = fill_nearest(field, known)
    if not known.any():
        assert (filled == 1).all()
        return
    np.testing.assert_array_equal(filled[known], field[known])
    assert np.isin(filled, field[known]).all()
