"""Patches are found in every view where the print of their middle is, also when the assumed surface is off."""

from __future__ import annotations

import numpy as np
import pytest

from oracles.table_cameras import cameras, mottled, on_plane, picture
from restore.photogrammetry.cameras.align import triangulate
from restore.photogrammetry.track import Patches, track

SAMPLE_MM = 0.7  # a pixel on the table
HEIGHT_MM = 5.0
GRID = np.stack(np.meshgrid(np.linspace(-60, 60, 7), np.linspace(-40, 40, 5)), axis=-1).reshape(-1, 2)
NOISE_CODES = 1.0


@pytest.fixture(scope="module")
def greys():
    rng = np.random.default_rng(1)
    exact = [picture(camera, lambda o, w: mottled(on_plane(o, w, HEIGHT_MM))) for camera in cameras()]
    gains = (1.0, 0.8, 1.1, 0.9, 1.05)  # exposures differ
    return np.stack(
        [g * e + 5 + rng.normal(0, NOISE_CODES, e.shape) for g, e in zip(gains, exact, strict=True)]
    ).astype(np.float32)


def level(height: float) -> Patches:
    count = len(GRID)
    tangents = np.tile(np.eye(3)[:2], (count, 1, 1))
    points = np.column_stack([GRID, np.full(count, height)])
    return Patches(points, tangents, np.tile([0.0, 0.0, 1.0], (count, 1)), np.zeros((count, 3)))


@pytest.mark.parametrize("off_mm", [0.0, 1.5])
def test_what_is_tracked_meets_on_the_surface(greys, off_mm):
    views = cameras()
    tracked = track(greys, views, level(HEIGHT_MM + off_mm), SAMPLE_MM)
    found = tracked.found(0.9, SAMPLE_MM)
    assert (found.sum(axis=0) >= 4).mean() > 0.9
    heights = []
    for i in np.flatnonzero(found.sum(axis=0) >= 4):
        seen = np.flatnonzero(found[:, i])
        heights.append(triangulate([views[v] for v in seen], tracked.pixels[seen, i])[2])
    assert np.abs(np.median(heights) - HEIGHT_MM) < 0.02
    assert np.sqrt(np.mean((np.array(heights) - HEIGHT_MM) ** 2)) < 0.1  # an eighth of a pixel


def test_pixels_are_where_the_cameras_see_the_points(greys):
    views = cameras()
    patches = level(HEIGHT_MM)
    tracked = track(greys, views, patches, SAMPLE_MM)
    found = tracked.found(0.9, SAMPLE_MM)
    exact = np.stack([camera.project(patches.points) for camera in views])
    error = np.linalg.norm(tracked.pixels - exact, axis=2)[found]
    assert np.sqrt((error**2).mean()) < 0.08
    predicted = tracked.sigma_mm[found] / SAMPLE_MM
    assert 0.2 < np.sqrt((error**2).mean()) / np.sqrt((predicted**2).mean() * 2) < 5


def test_smaller_copies_give_pixels_of_the_full_size(greys):
    twice = [camera.scaled((2 * camera.size[0], 2 * camera.size[1])) for camera in cameras()]
    patches = level(HEIGHT_MM)
    of_copies, of_full = (track(greys, views, patches, SAMPLE_MM) for views in (twice, cameras()))
    np.testing.assert_allclose(of_copies.pixels, 2 * (of_full.pixels + 0.5) - 0.5, atol=1e-6)
    np.testing.assert_allclose(of_copies.sigma_mm, of_full.sigma_mm, rtol=1e-6)


def test_blank_patches_and_other_pages_are_not_found(greys):
    blank = greys.copy()
    blank[:] = 120.0 + np.random.default_rng(2).normal(0, NOISE_CODES, greys.shape)
    assert track(blank, cameras(), level(HEIGHT_MM), SAMPLE_MM).found(0.9, SAMPLE_MM).sum() == 0
    other = greys.copy()
    other[1:] = greys[1:, ::-1]
    assert track(other, cameras(), level(HEIGHT_MM), SAMPLE_MM).found(0.9, SAMPLE_MM).mean() < 0.1
