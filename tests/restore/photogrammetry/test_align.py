"""Frames, similarities and triangulation, against exact cameras."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from oracles.table_cameras import cameras
from restore.photogrammetry.align import (
    Similarity,
    fit_similarity,
    line_of_sight,
    triangulate,
    triangulate_markers,
    upright,
)

EXACT = 1e-9
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
    places = {7: np.array([5.0, 5.0, 0.0]), 9: np.array([-30.0, 5.0, 0.0])}
    seen = {k: {m: camera.project(p[None])[0] for m, p in places.items()} for k, camera in views.items()}
    del seen[0][9], seen[1][9]
    found = triangulate_markers(views, seen, 3)
    assert list(found) == [7]
    np.testing.assert_allclose(found[7], places[7], atol=1e-6)


def test_upright_axes_are_a_right_handed_frame():
    axes = upright(np.array([0.0, 0.6, 0.8]), np.array([0.1, 1.0, 0.3]))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=EXACT)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[1] @ [0.1, 1.0, 0.3] > 0
