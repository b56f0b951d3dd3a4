"""Frames, similarities and triangulation, against exact cameras."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from oracles.table_cameras import camera_at, cameras
from restore.photogrammetry import SCALE_CARD
from restore.photogrammetry.cameras.align import (
    Similarity,
    agreeing_markers,
    fit_similarity,
    line_of_sight,
    triangulate,
    triangulate_markers,
    upright,
    views_that_agree,
)

EXACT = 1e-9
NOISE_PX = 0.1  # of a marker's centre
TURN = Rotation.from_rotvec([0.3, -0.8, 1.9]).as_matrix()
MOVE = Similarity(2.5, TURN, np.array([10.0, -40.0, 7.0]))
POINTS = np.random.default_rng(1).uniform(-60, 60, (20, 3))


def test_a_camera_sees_the_moved_points_where_it_saw_the_points():
    for camera in cameras():
        np.testing.assert_allclose(MOVE.camera(camera).project(MOVE.points(POINTS)), camera.project(POINTS), atol=1e-7)


def test_a_similarity_is_found_again():
    found = fit_similarity(POINTS, MOVE.points(POINTS))
    assert found.scale == pytest.approx(2.5)
    np.testing.assert_allclose(found.points(POINTS), MOVE.points(POINTS), atol=EXACT)


def test_points_of_a_plane_are_never_mirrored():
    flat = POINTS * [1, 1, 0]
    found = fit_similarity(flat, MOVE.points(flat))
    assert np.linalg.det(found.rotation) == pytest.approx(1.0)
    np.testing.assert_allclose(found.points(flat), MOVE.points(flat), atol=EXACT)


def test_a_point_is_triangulated():
    views = cameras(3)
    point = np.array([12.0, -7.0, 15.0])
    pixels = np.array([camera.project(point[None])[0] for camera in views])
    np.testing.assert_allclose(triangulate(views, pixels), point, atol=1e-6)


def test_noise_is_shared_between_the_views():
    views = cameras(5)
    point, rng = np.array([12.0, -7.0, 15.0]), np.random.default_rng(2)
    pixels = np.array([camera.project(point[None])[0] for camera in views])
    off = [triangulate(views, pixels + rng.normal(0, 0.1, pixels.shape)) - point for _ in range(50)]
    assert np.abs(off).max() < 0.5  # 0.1 px is 0.07 mm on the table, twice or three times as much in depth
    assert np.abs(np.mean(off, axis=0)).max() < 0.05


def test_a_line_of_sight_goes_through_its_point():
    for camera in cameras():
        way = POINTS[0] - camera.position
        pixel = camera.project(POINTS[:1])[0]
        np.testing.assert_allclose(line_of_sight(camera, pixel), way / np.linalg.norm(way), atol=1e-5)


def test_markers_need_enough_views():
    views = dict(enumerate(cameras(4)))
    places = {number: np.array([5.0 * number, 5.0, 0.0]) for number in (2, 4, 6, 7, 9)}
    seen = {k: {m: camera.project(p[None])[0] for m, p in places.items()} for k, camera in views.items()}
    del seen[0][9], seen[1][9]
    found = triangulate_markers(views, seen)
    assert list(found) == [2, 4, 6, 7]
    np.testing.assert_allclose(found[7], places[7], atol=1e-6)


def test_upright_axes_are_a_right_handed_frame():
    axes = upright(np.array([0.0, 0.6, 0.8]), np.array([0.1, 1.0, 0.3]))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=EXACT)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[1] @ [0.1, 1.0, 0.3] > 0


def around(count):
    """Cameras all round the table, by number."""
    angles = 2 * np.pi * np.arange(count) / count
    places = np.column_stack([150 * np.cos(angles), 150 * np.sin(angles), np.full(count, 270.0)])
    return {number: camera_at(place) for number, place in enumerate(places)}


def seen_card(views, moved, push_mm=3.0):
    """Markers (pixels) of a card in views; in the moved ones it lies elsewhere, pushed another way each time."""
    rng = np.random.default_rng(3)
    corners = np.column_stack([SCALE_CARD.centres + [0.0, -90.0], np.zeros(len(SCALE_CARD.centres))])
    seen = {}
    for number, camera in views.items():
        angle = 2.0 * number
        push = push_mm * np.array([np.cos(angle), np.sin(angle), 0.0]) if number in moved else np.zeros(3)
        pixels = camera.project(corners + push) + rng.normal(0, NOISE_PX, (len(corners), 2))
        seen[number] = dict(enumerate(pixels))
    return seen


@pytest.mark.parametrize("moved", [(), (3,), (0, 4)])
def test_views_before_which_the_card_was_moved_do_not_agree(moved):
    views = around(6)
    assert views_that_agree(views, seen_card(views, moved)) == [k for k in views if k not in moved]


def test_moved_views_have_no_part_in_the_markers():
    views = around(6)
    still, moved = (
        triangulate_markers(views, agreeing_markers(views, seen_card(views, which))) for which in ((), (1, 2))
    )
    for marker, point in still.items():
        assert np.linalg.norm(moved[marker] - point) < 3 * NOISE_PX


def test_a_card_that_lies_elsewhere_in_every_view_is_nowhere():
    views = dict(enumerate(cameras(5)))
    seen = seen_card(views, tuple(views), push_mm=20.0)
    assert views_that_agree(views, seen) == []
    assert triangulate_markers(views, agreeing_markers(views, seen)) == {}


def test_many_views_are_sampled():
    views = around(24)  # 2024 samples of three
    assert views_that_agree(views, seen_card(views, (5, 11))) == [k for k in views if k not in (5, 11)]
