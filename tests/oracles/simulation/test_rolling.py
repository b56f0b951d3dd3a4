"""A camera that turns while it is read: rays and pixels agree, row by row."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from oracles.simulation.camera import look_at
from oracles.simulation.rolling import RollingCamera

STILL = look_at(
    np.array([0.0, 0.0, -900.0]), np.array([80.0, -60.0, -520.0]), size=(640, 480), focal_px=480.0, roll_deg=7.0,
    offset=(3.0, -2.0), radial=(0.06, -0.11, 0.05), tangential=(4e-4, -3e-4),
)  # fmt: skip
TURN_DEG = (0.3, -0.2, 0.5)
ROLLING = RollingCamera.of(STILL, TURN_DEG)
POINTS = np.array([[0.0, 0.0, -900.0], [70.0, 40.0, -890.0], [-90.0, -50.0, -905.0]])
EXACT_PX = 1e-6
MOVED_PX = 0.1  # a hundredth of what half of the turn moves the edge of the picture by


def test_a_point_is_seen_where_its_line_of_sight_goes():
    pixels = ROLLING.project(POINTS)
    rays = ROLLING.through(pixels)
    towards = POINTS - ROLLING.position
    off = np.cross(rays / np.linalg.norm(rays, axis=1, keepdims=True), towards)
    np.testing.assert_allclose(off, 0.0, atol=EXACT_PX)


def test_rows_have_the_lines_of_sight_of_their_pixels():
    rays = ROLLING.directions(100, 103)
    pixels = np.array([[5.0, 100.0], [320.0, 101.0], [630.0, 102.0]])
    expected = ROLLING.through(pixels)
    found = rays[[0, 1, 2], [5, 320, 630]]
    np.testing.assert_allclose(found, expected, atol=1e-6)  # single precision


def test_the_first_and_last_row_differ_by_the_turn():
    first, last = (RollingCamera.through(ROLLING, np.array([[320.0, row]])) for row in (0.0, 479.0))
    still = [STILL.through(np.array([[320.0, row]])) for row in (0.0, 479.0)]
    half = Rotation.from_rotvec(np.radians(TURN_DEG) @ STILL.axes * 479 / 960)
    np.testing.assert_allclose(half.inv().apply(last), still[1], atol=1e-12)
    np.testing.assert_allclose(half.apply(first), still[0], atol=1e-12)


def test_without_a_turn_it_is_an_ordinary_camera():
    steady = RollingCamera.of(STILL, (0.0, 0.0, 0.0))
    np.testing.assert_allclose(steady.project(POINTS), STILL.project(POINTS), atol=1e-12)
    assert np.abs(ROLLING.project(POINTS) - STILL.project(POINTS)).max() > MOVED_PX
