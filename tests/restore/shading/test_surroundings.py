"""What a page shows of itself to its own places, against the view of a valley's other side in closed form."""

import numpy as np
import pytest

from restore.shading.surroundings import PATCH, Places, surroundings_of
from tests.restore.shading.test_horizon_map import HALF_MM, SLOPE, relief

# A slice of 15° in azimuth counts whole or not, a patch is 12 mm wide, and the sides end after 100 mm: of the closed
# form, which is that of an endless valley.
NEAR = 0.2
NOTHING = 1e-3


@pytest.fixture(scope="module")
def valley():
    return surroundings_of(relief(lambda xy: SLOPE * np.abs(xy[:, 0])))


@pytest.fixture(scope="module")
def plane():
    return surroundings_of(relief(lambda xy: 0.3 * xy[:, 0]))


def at(surroundings, x, y):
    point = np.array([[x, y, 0.0]], np.float32)
    nodes = surroundings.horizon.nodes(point)
    return Places(point, np.zeros_like(point), np.ones(1, np.float32), nodes)


def test_a_plane_shows_nothing_of_itself(plane):
    assert plane.fractions.sum(axis=1).max() < NOTHING


@pytest.mark.parametrize("x", [-40.0, -20.0, -10.0])
def test_from_one_side_of_a_valley_the_other_fills_its_fraction_of_the_view(valley, x):
    """An endless strip that rises by an angle α over a place's own plane fills (1 − cos α) / 2 of its view."""
    to_the_rim = np.arctan(SLOPE * (HALF_MM + x) / (HALF_MM - x))
    expected = (1 - np.cos(to_the_rim + np.arctan(SLOPE))) / 2
    shares = valley.fractions_at(at(valley, x, 0.0))
    assert shares.sum() == pytest.approx(expected, rel=NEAR)
    across = valley.patches.points[shares.indices, 0]
    assert (across > -PATCH * valley.horizon.pitch).all()  # on the other side, or in the bottom between them


def test_what_a_page_reflects_to_itself_goes_with_what_falls_on_it(valley):
    rows, cols = valley.horizon.heights.shape
    lit = np.where(valley.patches.points[:, :1] > 0, [1.0, 2.0, 3.0], 0.0)
    reflected = valley.reflected(lit.astype(np.float32))
    assert reflected.shape == (rows, cols, 3)
    dark, bright = reflected[rows // 2, cols // 4], reflected[rows // 2, 3 * cols // 4]
    np.testing.assert_allclose(dark, dark[0] * np.array([1, 2, 3]), rtol=1e-5)
    assert bright.max() < dark.max() / 10
    assert valley.fractions.sum(axis=1).max() < 1
