"""Values given at the corners of triangles are interpolated at every pixel centre."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from restore.mesh import raster
from restore.mesh.raster import EDGE_TOLERANCE, FARTHEST, rasterise

HEIGHT, WIDTH = 40, 50
SINGLE = 2e-5  # values of up to 200 in float32, which keeps seven digits

SQUARE = np.array([[4.5, 3.5], [44.5, 3.5], [44.5, 33.5], [4.5, 33.5]])


def affine(positions):
    """Two values at positions (…, 2) = (x, y)."""
    x, y = np.moveaxis(np.asarray(positions, float), -1, 0)
    return np.stack([3.0 + 2.0 * x - 1.5 * y, 100.0 - x + 0.25 * y], axis=-1)


def centres():
    rows, cols = np.indices((HEIGHT, WIDTH))
    return np.dstack([cols, rows])


@settings(deadline=None)  # the first run compiles
@given(st.integers(0, 2**32 - 1), st.integers(0, 60))
def test_an_affine_field_is_exact_at_every_pixel_and_no_pixel_falls_between_two_triangles(seed, inner):
    random = np.random.default_rng(seed)
    corners = np.concatenate([SQUARE, random.uniform(SQUARE[0], SQUARE[2], (inner, 2))])
    picture = rasterise(corners, Delaunay(corners).simplices.astype(np.int64), affine(corners), HEIGHT, WIDTH)
    within = ((centres() > SQUARE[0]) & (centres() < SQUARE[2])).all(axis=2)
    np.testing.assert_array_equal(np.isfinite(picture).all(axis=2), within)
    np.testing.assert_allclose(picture[within], affine(centres())[within], atol=SINGLE)


def test_pixel_centres_on_an_edge_belong_to_the_triangle():
    corners = np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]])
    picture = rasterise(corners, np.array([[0, 1, 2]]), np.ones((3, 1)), 12, 12)[..., 0]
    rows, cols = np.indices((12, 12))
    np.testing.assert_array_equal(picture == 1.0, rows + cols <= 10)


FAR = [np.inf, -np.inf, np.nan, 1e25, -1e25, 1e300, -1e300, 2 * FARTHEST, -2 * FARTHEST]


@pytest.mark.parametrize("far", FAR)
@pytest.mark.parametrize("corner", [0, 1, 2])
@pytest.mark.parametrize("buffered", [False, True])
def test_a_triangle_with_a_corner_beyond_all_numbers_is_hidden_and_the_others_shown(far, corner, buffered):
    corners = np.array([[4.5, 3.5], [44.5, 3.5], [4.5, 33.5], [4.5, 3.5], [44.5, 3.5], [4.5, 33.5]])
    inverse = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0]) if buffered else None
    faces = np.array([[0, 1, 2], [3, 4, 5]])
    alone = rasterise(corners, faces[:1], affine(corners), HEIGHT, WIDTH, inverse)
    for axes in ([0], [1], [0, 1]):
        beyond = corners.copy()
        beyond[3 + corner, axes] = far
        shown = rasterise(beyond, faces, affine(corners), HEIGHT, WIDTH, inverse)
        np.testing.assert_array_equal(shown, alone)


CLEAR = 1e-4  # pixels from an edge, on which rounding would decide
FAR_OUT = st.floats(-1e5, 1e5) | st.floats(-10.0, 60.0)  # pixels: far outside the picture, or in it


@settings(deadline=None)
@given(st.tuples(*[FAR_OUT] * 6))
def test_a_triangle_that_reaches_far_beyond_the_picture_shows_in_it_what_a_plain_search_finds(places):
    corners = np.reshape(places, (3, 2))
    along = np.roll(corners, -1, axis=0) - corners
    area = along[0, 0] * along[1, 1] - along[0, 1] * along[1, 0]
    assume(abs(area) > 1.0)
    offset = centres()[:, :, None] - corners
    inwards = np.sign(area) * (along[:, 0] * offset[..., 1] - along[:, 1] * offset[..., 0])
    lengths = np.linalg.norm(along, axis=1)
    nearest = (inwards / lengths).min(axis=2)  # pixels within the nearest edge
    shown = np.isfinite(rasterise(corners, np.array([[0, 1, 2]]), affine(corners), HEIGHT, WIDTH)).all(axis=2)
    # The tolerance at edges is a share of a triangle, whose heights are this many pixels.
    clear = np.abs(nearest) > CLEAR + EDGE_TOLERANCE * abs(area) / lengths.min()
    np.testing.assert_array_equal(shown[clear], nearest[clear] > 0)


@pytest.mark.parametrize("order", [[0, 1, 2], [2, 1, 0], [1, 2, 0]])
def test_a_triangle_covers_what_lies_on_the_same_side_of_all_its_edges_whatever_its_winding(order):
    corners = np.array([[1.3, 2.2], [30.1, 7.7], [11.4, 28.9]])
    picture = rasterise(corners, np.array([order]), affine(corners), HEIGHT, WIDTH)
    along = np.roll(corners, -1, axis=0) - corners
    offset = centres()[:, :, None] - corners
    within = (along[:, 0] * offset[..., 1] - along[:, 1] * offset[..., 0] > 0).all(axis=2)
    np.testing.assert_array_equal(np.isfinite(picture).all(axis=2), within)
    np.testing.assert_allclose(picture[within], affine(centres())[within], atol=SINGLE)


def test_triangles_without_area_or_beyond_the_picture_cover_no_pixel():
    corners = np.array([[1, 1], [20, 20], [30, 30], [-50, -50], [-40, -50], [-40, -40]], float)
    picture = rasterise(corners, np.array([[0, 1, 2], [3, 4, 5], [0, 0, 1]]), affine(corners), HEIGHT, WIDTH)
    assert np.isnan(picture).all()


def test_a_triangle_larger_than_the_picture_fills_it():
    corners = np.array([[-200, -200], [400, -200], [-200, 400]], float)
    picture = rasterise(corners, np.array([[0, 1, 2]]), affine(corners), HEIGHT, WIDTH)
    np.testing.assert_allclose(picture, affine(centres()), atol=SINGLE)


def test_compiled_and_plain_python_rasterise_alike(monkeypatch):
    corners = np.random.default_rng(4).uniform(0, 12, (9, 2))
    faces = Delaunay(corners).simplices.astype(np.int64)
    compiled = rasterise(corners, faces, affine(corners), 12, 12)
    monkeypatch.setattr(raster, "_draw", raster._draw.py_func)
    plain = rasterise(corners, faces, affine(corners), 12, 12)
    assert np.isfinite(compiled).any()
    np.testing.assert_allclose(compiled, plain, atol=SINGLE)


def two_layers(order):
    """Two squares over the same pixels at depths 5 and 2, in an order of their faces."""
    corners, depth = np.concatenate([SQUARE, SQUARE]), np.repeat([5.0, 2.0], 4)
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])[order]
    return corners, faces, depth


@pytest.mark.parametrize("order", [[0, 1, 2, 3], [2, 3, 0, 1], [0, 2, 1, 3]])
def test_with_inverse_depth_the_nearest_triangle_is_shown_in_any_order(order):
    corners, faces, depth = two_layers(order)
    picture = rasterise(corners, faces, depth[:, None], HEIGHT, WIDTH, 1.0 / depth)[..., 0]
    np.testing.assert_allclose(picture[np.isfinite(picture)], 2.0, atol=SINGLE)


def test_a_triangle_with_a_corner_behind_the_camera_is_not_shown():
    corners, faces, depth = two_layers([0, 1, 2, 3])
    inverse_depth = 1.0 / depth
    inverse_depth[4] *= -1.0
    picture = rasterise(corners, faces, depth[:, None], HEIGHT, WIDTH, inverse_depth)[..., 0]
    np.testing.assert_allclose(picture[np.isfinite(picture)], 5.0, atol=SINGLE)


def test_values_divided_by_depth_are_interpolated_affinely_in_space():
    """Half way across the picture of a strip that runs away from the eye is nearer than half way along it."""
    corners = np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]])
    inverse = 1.0 / np.array([1.0, 3.0, 3.0, 1.0])
    along = np.array([0.0, 1.0, 1.0, 0.0])
    values = np.stack([inverse, along * inverse], axis=1)
    picture = rasterise(corners, np.array([[0, 1, 2], [0, 2, 3]]), values, 9, 9, inverse)
    # 1/depth is half way between 1 and 1/3 there: depth 1.5, a quarter of the way from 1 to 3.
    np.testing.assert_allclose(picture[:, 4, 1] / picture[:, 4, 0], 0.25, atol=SINGLE)


def test_the_z_buffer_compiled_and_in_plain_python_agree(monkeypatch):
    random = np.random.default_rng(3)
    corners, faces = random.uniform(-5, 25, (12, 2)), random.integers(0, 12, (9, 3))
    inverse = 1.0 / random.uniform(1, 2, 12)
    compiled = rasterise(corners, faces, affine(corners), 20, 24, inverse)
    monkeypatch.setattr(raster, "_draw", raster._draw.py_func)
    plain = rasterise(corners, faces, affine(corners), 20, 24, inverse)
    np.testing.assert_allclose(compiled, plain, atol=SINGLE)


@pytest.mark.parametrize("height", [1, 3, 4, 41])
@pytest.mark.parametrize("buffered", [False, True])
def test_the_bands_that_a_picture_is_drawn_in_do_not_show(monkeypatch, height, buffered):
    random = np.random.default_rng(5)
    corners, faces = random.uniform(-5, 45, (20, 2)), random.integers(0, 20, (30, 3))
    inverse = 1.0 / random.uniform(1, 2, 20) if buffered else None
    banded = rasterise(corners, faces, affine(corners), height, WIDTH, inverse)
    monkeypatch.setattr(raster, "PICTURE_BANDS", 1)
    np.testing.assert_array_equal(rasterise(corners, faces, affine(corners), height, WIDTH, inverse), banded)


def test_the_tolerance_at_edges_is_below_one_colour_level():
    assert EDGE_TOLERANCE < 1 / 255


@settings(deadline=None)  # the first run compiles
@given(st.integers(0, 10**6), st.sampled_from([1.0, 1e-3, 1e-7, 1e-12]))
def test_bounds_of_a_row_leave_out_no_pixel_of_a_triangle(seed, flatness):
    """Also of slivers that lie nearly along a row: the test of each pixel is repeated here without bounds."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-10.0, 60.0, (3, 2)) * [1.0, flatness] + [0.0, rng.integers(0, HEIGHT)]
    (ax, ay), (ux, uy), (vx, vy) = corners[0], corners[1] - corners[0], corners[2] - corners[0]
    area = ux * vy - uy * vx
    assume(abs(area) >= EDGE_TOLERANCE)
    x, y = centres()[..., 0] - ax, centres()[..., 1] - ay
    u, v = (x * vy - y * vx) / area, (ux * y - uy * x) / area
    inside = (u >= -EDGE_TOLERANCE) & (v >= -EDGE_TOLERANCE) & (u + v <= 1 + EDGE_TOLERANCE)
    rows, cols = centres()[..., 1], centres()[..., 0]
    inside &= (rows >= corners[:, 1].min()) & (rows <= corners[:, 1].max())
    inside &= (cols >= corners[:, 0].min()) & (cols <= corners[:, 0].max())
    drawn = rasterise(corners, np.array([[0, 1, 2]]), affine(corners), HEIGHT, WIDTH)
    np.testing.assert_array_equal(np.isfinite(drawn[..., 0]), inside)


def test_rows_from_a_first_one_on_are_those_of_the_whole():
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    whole = rasterise(SQUARE, faces, affine(SQUARE), HEIGHT, WIDTH)
    part = rasterise(SQUARE, faces, affine(SQUARE), 20, WIDTH, first=11)
    np.testing.assert_array_equal(part, whole[11:31])
