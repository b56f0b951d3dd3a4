"""The simulated projector lights what its rays reach, with the pattern's own pixel, and nothing in shadow."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.simulated import Curl, Flat, Markers
from oracles.simulation.projector import RigPlan, build_rig

PLAN = RigPlan(size=(320, 240), projector=(200, 125), distance_mm=500.0, baseline_mm=200.0, view_mm=220.0, noise=0.0)
PAGE_MM = (130.0, 100.0)
EDGE_PX = 1.0  # of the camera: half of its light is seen within a pixel of a sharp edge
MIDDLE = np.s_[40:200, 40:280]  # all of it in the projector's light
EXACT_MM = 1e-3  # the hit's face is single precision


@pytest.fixture(scope="module")
def rig():
    return build_rig(Flat(), Markers(), PLAN, page_mm=PAGE_MM)


def seen(rig, pattern, seed=0):
    """(h, w) float: the brightness of what the camera sees of one pattern."""
    return next(rig.captures([pattern], np.random.default_rng(seed))).astype(float).mean(axis=2)


def test_a_half_that_is_lit_ends_where_the_projectors_pixel_is_seen(rig):
    left = np.zeros((125, 200), np.uint8)
    left[:, :100] = 255
    white = np.full_like(left, 255)
    share = (seen(rig, left) - seen(rig, 0 * left)) / np.maximum(seen(rig, white) - seen(rig, 0 * left), 1)
    pixels = np.column_stack([np.full(5, 0.0), np.linspace(60, 180, 5)])
    for _, row in pixels:
        edge = np.flatnonzero(share[int(row)] > 0.5).max() + 0.5
        tangents = (np.array([[edge, row]]) - rig.camera.centre) / rig.camera.focal_px
        point, _ = rig.points(tangents)
        world = point @ rig.camera.axes + rig.camera.position
        column = rig.projector.project(world)[0, 0]
        assert abs(column - 99.5) < EDGE_PX * 200 / 320 * 2


def test_points_and_places_are_those_of_the_page(rig):
    places = np.array([[20.0, 30.0], [65.0, 50.0], [110.0, 80.0]])
    points = (rig.scene.surface(places) - rig.camera.position) @ rig.camera.axes.T
    found, on_page = rig.points(points[:, :2] / points[:, 2:])
    np.testing.assert_allclose(found, points, atol=EXACT_MM)
    np.testing.assert_allclose(on_page, places, atol=EXACT_MM)


def test_the_rigs_motion_takes_the_cameras_frame_to_the_projectors(rig):
    points = rig.scene.surface(np.array([[20.0, 30.0], [110.0, 80.0]]))
    camera = (points - rig.camera.position) @ rig.camera.axes.T
    lamp = (points - rig.projector.position) @ rig.projector.axes.T
    np.testing.assert_allclose(camera @ rig.rotation.T + rig.shift, lamp, atol=1e-9)


def test_a_raised_edge_shades_the_table_from_the_projector():
    shares = []
    for sheet in (Curl(radius_mm=60.0), Flat()):
        rig = build_rig(sheet, Markers(), PLAN, page_mm=PAGE_MM)
        white, black = (seen(rig, np.full((125, 200), level, np.uint8)) for level in (255, 0))
        shares.append(((white - black) < 1)[MIDDLE].mean())
    assert shares[0] > 0.0005
    assert shares[1] == 0


def test_the_same_seed_gives_the_same_pictures(rig):
    pattern = np.full((125, 200), 255, np.uint8)
    np.testing.assert_array_equal(seen(rig, pattern, 3), seen(rig, pattern, 3))
