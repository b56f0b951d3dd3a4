"""A rectangular page is aligned with the axes and measured; any other is left unchanged."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from restore.mesh.topology import Topology
from restore.outline.rectangle import (
    CORNER_FRACTION,
    MIN_TORN_FILL,
    SIDE_BAND_MM,
    fills_rectangle,
    has_straight_sides,
    page_size,
    squaring_rotation,
)

WIDTH, HEIGHT = 280.0, 200.0
SQUARE_RAD = 1e-6  # 0.3 µm over the page: the rough turn is found in single precision, the sides then to rounding
NOISY_RAD = 2e-4  # 0.05 mm over the page; 400 points that scatter by 0.1 mm tell it to half of that
SIZE_MM = 1e-6
TORN_RAD = 2e-3  # of the slanting tear the 2 mm next to a side count as the side, 0.5 mm over the page at the worst
NOISY_SIZE_MM = 0.1  # the medians of 100 points that scatter by 0.1 mm, on sides with a tag or a dent

leaning = st.floats(-44.0, 44.0)  # one that leans by 45° is as near to either side


def rectangle(count=100, width=WIDTH, height=HEIGHT):
    """Points round a page, (4·count, 2) mm."""
    t = np.linspace(-0.5, 0.5, count)
    side = np.full(count, 0.5)
    corners = [np.column_stack(pair) for pair in ((t, -side), (t, side), (-side, t), (side, t))]
    return np.vstack(corners) * [width, height]


def turn(degrees):
    angle = np.deg2rad(degrees)
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def assert_undone(rotation, degrees, within):
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(2), atol=1e-12)
    total = rotation @ turn(degrees)
    assert abs(np.arctan2(total[1, 0], total[0, 0])) < within


@settings(deadline=None)
@given(leaning, st.floats(-500, 500), st.floats(-500, 500), st.sampled_from([(280, 200), (200, 280), (150, 150)]))
def test_a_rotated_rectangle_is_aligned_with_the_axes(degrees, x, y, size):
    outline = rectangle(width=size[0], height=size[1]) @ turn(degrees).T + [x, y]
    assert_undone(squaring_rotation(outline, size[0] * size[1]), degrees, SQUARE_RAD)


@pytest.mark.parametrize("degrees", [-31.0, -3.0, 0.5, 12.0])
def test_rough_sides_and_dog_ears_do_not_change_the_rotation(degrees):
    outline = rectangle() + np.random.default_rng(0).normal(0, 0.1, (400, 2))
    ear = (outline @ [1, 1]) > 0.5 * (WIDTH + HEIGHT) - 12
    outline[ear] -= 4.0
    assert_undone(squaring_rotation(outline @ turn(degrees).T, WIDTH * HEIGHT), degrees, NOISY_RAD)


@pytest.mark.parametrize("degrees", [-31.0, -3.0, 0.5, 12.0])
@pytest.mark.parametrize("tip_mm", [3.0, 20.0, 80.0])
def test_a_tip_beyond_a_side_changes_neither_rotation_nor_size(degrees, tip_mm):
    outline = rectangle() + np.random.default_rng(2).normal(0, 0.1, (400, 2))
    outline[250:253, 0] -= [tip_mm / 2, tip_mm, tip_mm / 3]  # where a scan lost its way at the left side
    rotation = squaring_rotation(outline @ turn(degrees).T, WIDTH * HEIGHT)
    assert_undone(rotation, degrees, NOISY_RAD)
    np.testing.assert_allclose(page_size(outline @ turn(degrees).T @ rotation.T), [WIDTH, HEIGHT], atol=NOISY_SIZE_MM)


def circle():
    around = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    return 100 * np.column_stack([np.cos(around), np.sin(around)]), np.pi * 100**2


def triangle():
    t = np.linspace(0, 1, 100)[:, None]
    corners = np.array([[0, 0], [280, 30], [60, 200]], float)
    return np.vstack([(1 - t) * a + t * np.roll(corners, -1, 0)[k] for k, a in enumerate(corners)]), 27_100.0


def torn():
    """A page that lacks more than the share that still makes a rectangle."""
    return rectangle() @ turn(10).T, (MIN_TORN_FILL - 0.01) * WIDTH * HEIGHT


def polygon(*corners):
    """Points every millimetre round a polygon, rough by 0.2 mm, turned by 10°, and its area."""
    start = np.array(corners, float)
    end = np.roll(start, -1, axis=0)
    counts = np.linalg.norm(end - start, axis=1).astype(int)
    sides = [np.linspace(a, b, count, endpoint=False) for a, b, count in zip(start, end, counts, strict=True)]
    outline = np.concatenate(sides)
    area = 0.5 * abs((start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]).sum())
    return (outline + np.random.default_rng(3).normal(0, 0.2, outline.shape)) @ turn(10).T, area


def without_corner(share, aspect):
    """A page that lacks a triangle at one corner, of a share of its area, `aspect` as wide as the page is."""
    across, up = np.sqrt(2 * share * aspect) * WIDTH, np.sqrt(2 * share / aspect) * HEIGHT
    return polygon((0, 0), (WIDTH, 0), (WIDTH, HEIGHT - up), (WIDTH - across, HEIGHT), (0, HEIGHT))


def right_trapezium():
    """Nine tenths of its rectangle, with three sides of it."""
    return polygon((0, 0), (WIDTH, 0), (0.8 * WIDTH, HEIGHT), (0, HEIGHT))


def parallelogram():
    return polygon((0, 0), (WIDTH, 0), (1.1 * WIDTH, HEIGHT), (0.1 * WIDTH, HEIGHT))


def octagon():
    a, b = 0.29 * WIDTH, 0.29 * HEIGHT
    upper = [(WIDTH - a, 0), (WIDTH, b), (WIDTH, HEIGHT - b), (WIDTH - a, HEIGHT)]
    return polygon((a, 0), *upper, (a, HEIGHT), (0, HEIGHT - b), (0, b))


def ell():
    low = 0.45 * HEIGHT
    return polygon((0, 0), (WIDTH, 0), (WIDTH, low), (0.45 * WIDTH, low), (0.45 * WIDTH, HEIGHT), (0, HEIGHT))


def oval():
    """Nine tenths of its rectangle, between an ellipse and that (Lamé's curve of the fourth power)."""
    around = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    across, up = (np.sign(way) * np.sqrt(np.abs(way)) for way in (np.cos(around), np.sin(around)))
    return polygon(*np.column_stack([across * WIDTH / 2, up * HEIGHT / 2]).tolist())


@pytest.mark.parametrize("aspect", [0.6, 1.0, 1.6])
@pytest.mark.parametrize("share", [0.06, 0.1, 0.15])
def test_a_page_with_a_corner_torn_off_is_squared(share, aspect):
    outline, area = without_corner(share, aspect)
    assert not fills_rectangle(outline, area)
    rotation = squaring_rotation(outline, area)
    assert_undone(rotation, 10.0, TORN_RAD)
    np.testing.assert_allclose(page_size(outline @ rotation.T), [WIDTH, HEIGHT], rtol=TORN_RAD)


@pytest.mark.parametrize("outline", [right_trapezium, parallelogram, octagon, ell, oval])
def test_straight_sides_of_other_shapes_are_not_those_of_a_rectangle(outline):
    assert not has_straight_sides(*outline())


@pytest.mark.parametrize("outline", [circle, triangle, torn])
def test_a_page_that_is_not_rectangular_is_not_rotated(outline):
    np.testing.assert_array_equal(squaring_rotation(*outline()), np.eye(2))


@settings(deadline=None)
@given(st.floats(20, 1000), st.floats(20, 1000), st.floats(-500, 500))
def test_the_size_of_a_page_is_the_distance_of_its_sides(width, height, shift):
    found = page_size(rectangle(width=width, height=height) + shift)
    np.testing.assert_allclose(found, [width, height], atol=SIZE_MM)


@pytest.mark.parametrize("height", [0.5, 1.9, 3.0])
def test_on_a_strip_the_sides_are_distinguished(height):
    np.testing.assert_allclose(page_size(rectangle(width=500.0, height=height)), [500.0, height], atol=SIZE_MM)


def test_a_tag_a_dent_and_rough_sides_do_not_change_the_size():
    outline = rectangle() + np.random.default_rng(1).normal(0, 0.1, (400, 2))
    outline[150:155, 1] += 1.5  # a tag on the upper side
    outline[250:260, 0] += 1.5  # a dent in the left
    corner = np.abs(outline @ [1, 1]) > (0.5 - CORNER_FRACTION / 2) * (WIDTH + HEIGHT)
    outline[corner] *= 0.99
    np.testing.assert_allclose(page_size(outline), [WIDTH, HEIGHT], atol=NOISY_SIZE_MM)


def test_the_size_of_an_outline_without_sides_is_its_extent():
    corners = np.array([[0.0, 30.0], [40.0, 0.0], [80.0, 30.0], [40.0, 60.0]])
    assert page_size(corners) == (80.0, 60.0)


@given(st.floats(0, 360))
def test_an_outline_of_three_points_has_a_size(degrees):
    turn = np.deg2rad(degrees + np.array([0.0, 120.0, 240.0]))
    assert min(page_size(60.0 * np.stack([np.cos(turn), np.sin(turn)], axis=1))) > 0


def test_pointed_corners_are_not_tips():
    outline, _ = triangle()
    assert page_size(outline) == pytest.approx((280.0, 200.0), abs=SIDE_BAND_MM)


def test_a_side_of_a_few_points_at_one_place_does_not_turn_the_page():
    """Its slope is not determined."""
    outline = np.array([[0, 0], [100, 0], [100, 50], [50, 50], [50, 50.01], [50, 49.99], [0, 50]], float)
    np.testing.assert_allclose(squaring_rotation(outline, 5000.0), np.eye(2), atol=1e-3)  # that of 0.01 mm in 100


def test_the_border_is_the_ends_of_edges_with_one_face():
    grid = np.arange(12).reshape(3, 4)
    a, b, c, d = (part.ravel() for part in (grid[:-1, :-1], grid[:-1, 1:], grid[1:, :-1], grid[1:, 1:]))
    faces = np.vstack([np.column_stack([a, c, d]), np.column_stack([a, d, b])])
    np.testing.assert_array_equal(Topology(faces).border, [0, 1, 2, 3, 4, 7, 8, 9, 10, 11])
    np.testing.assert_array_equal(Topology(faces[:, ::-1]).border, Topology(faces).border)
