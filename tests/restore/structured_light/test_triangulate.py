"""Depths of exact correspondences are exact; a place off its epipolar line has the distance as its residual."""

from __future__ import annotations

import cv2
import numpy as np

from oracles.structured_light import rig_of
from restore.structured_light.triangulate import triangulate

DEPTH_MM = 1e-4  # the undistortion's millionth of a pixel, at the rig's distance and angle
RESIDUAL_PX = 0.02  # distances in the distorted picture and without distortion differ by its third of a percent


def correspondences(simulated):
    """Tangents (n, 2) of the camera, true depths (n,) mm and projector pixels (n, 2) of a box of points."""
    rig = rig_of(simulated)
    rng = np.random.default_rng(0)
    points = rng.uniform([-60, -40, 420], [60, 40, 560], (200, 3))
    rotation = cv2.Rodrigues(rig.rotation)[0]
    pixels, _ = cv2.projectPoints(points, rotation, rig.shift, rig.lamp.matrix, rig.lamp.distortion)
    return rig, points[:, :2] / points[:, 2:], points[:, 2], pixels[:, 0]


def test_exact_correspondences_have_exact_depths(simulated):
    rig, tangents, depth, pixels = correspondences(simulated)
    found, residual = triangulate(rig, tangents, pixels)
    np.testing.assert_allclose(found, depth, atol=DEPTH_MM)
    np.testing.assert_allclose(residual, 0, atol=1e-4)


def test_the_residual_is_the_distance_from_the_epipolar_line(simulated):
    rig, tangents, depth, pixels = correspondences(simulated)
    moved = pixels + [0.0, 1.0]  # the projector is beside the camera: its rows run along the epipolar lines
    found, residual = triangulate(rig, tangents, moved)
    assert np.abs(np.abs(residual) - 1.0).max() < 0.1  # lines lean by some degrees
    assert np.abs(found - depth).max() < 0.5


def test_unknown_places_stay_unknown(simulated):
    rig, tangents, _, pixels = correspondences(simulated)
    pixels[3, 1] = np.nan
    found, residual = triangulate(rig, tangents, pixels)
    assert np.isnan([found[3], residual[3]]).all()
    assert np.isfinite(found).sum() == 199
    assert np.isnan(triangulate(rig, tangents, np.full_like(pixels, np.nan))[0]).all()
