"""Bundle adjustment finds cameras and points again from pixels, within their noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from oracles.table_cameras import SIZE, cameras
from restore.camera.photo_camera import PhotoCamera
from restore.photogrammetry.cameras.align import fit_similarity
from restore.photogrammetry.cameras.bundle import Tracks, adjust

NOISE_PX = 0.05
GRID = np.stack(np.meshgrid(np.linspace(-110, 110, 14), np.linspace(-80, 80, 11)), axis=-1).reshape(-1, 2)
POINTS = np.column_stack([GRID, 12.0 * np.sin(GRID[:, 0] / 25.0)])


def tracked(views, points, rng, noise=NOISE_PX) -> Tracks:
    view, point, pixels = [], [], []
    for k, camera in enumerate(views):
        seen = camera.project(points)
        inside = ((seen > 0) & (seen < np.array(SIZE) - 1)).all(axis=1)
        view += [k] * inside.sum()
        point += np.flatnonzero(inside).tolist()
        pixels.append(seen[inside])
    pixels = np.concatenate(pixels)
    return Tracks(np.array(view), np.array(point), pixels + rng.normal(0, noise, pixels.shape), np.ones(len(view)))


def disturbed(camera: PhotoCamera, rng) -> PhotoCamera:
    vector = camera.vector.copy()
    turn = Rotation.from_rotvec(rng.normal(0, 0.003, 3)).as_matrix() @ camera.rotation
    vector[:3] = Rotation.from_matrix(turn).as_rotvec()
    vector[3:6] += rng.normal(0, 1.0, 3)
    vector[6] *= 1.01
    vector[9:] = [0.0, 0.0, 0.0, 0.0, 0.0]
    return PhotoCamera(vector, camera.size)


def surface_error(points) -> float:
    """mm rms after the best similarity: pictures alone leave scale and frame open."""
    moved = fit_similarity(points, POINTS).points(points)
    return float(np.sqrt(((moved - POINTS) ** 2).sum(axis=1).mean()))


def test_cameras_and_points_are_found_again():
    rng = np.random.default_rng(1)
    views = cameras()
    tracks = tracked(views, POINTS, rng)
    start = POINTS + rng.normal(0, 1.0, POINTS.shape)
    found = adjust([disturbed(camera, rng) for camera in views], start, tracks)
    assert np.sqrt((found.residuals**2).mean()) < 1.1 * NOISE_PX
    assert found.sigma0 == pytest.approx(NOISE_PX, rel=0.3)
    assert surface_error(start) > 1.0
    assert surface_error(found.points) < 0.1  # 0.05 px is 0.035 mm on the table, twice as much in depth
    assert found.cameras[0].focal_px == pytest.approx(views[0].focal_px, rel=2e-3)


def test_outliers_have_no_weight():
    rng = np.random.default_rng(2)
    views = cameras()
    tracks = tracked(views, POINTS, rng)
    wrong = rng.random(len(tracks.view)) < 0.03
    tracks.pixels[wrong] += rng.uniform(3, 10, (wrong.sum(), 2))
    found = adjust(views, POINTS, tracks)
    kept = np.ones(len(POINTS), bool)
    kept[tracks.point[wrong]] = False
    moved = fit_similarity(found.points[kept], POINTS[kept]).points(found.points[kept])
    assert np.sqrt(((moved - POINTS[kept]) ** 2).sum(axis=1).mean()) < 0.1


def test_views_that_breathe_are_followed():
    rng = np.random.default_rng(3)
    views = cameras()
    focals = [1.0, 1.001, 0.9993, 1.0006, 0.9995]
    breathing = []
    for camera, share in zip(views, focals, strict=True):
        vector = camera.vector.copy()
        vector[6] *= share
        breathing.append(PhotoCamera(vector, camera.size))
    found = adjust(views, POINTS, tracked(breathing, POINTS, rng))
    assert np.sqrt((found.residuals**2).mean()) < 1.1 * NOISE_PX
    assert surface_error(found.points) < 0.12


def test_points_that_nothing_sees_stay():
    rng = np.random.default_rng(4)
    views = cameras()
    tracks = tracked(views, POINTS, rng)
    lonely = np.vstack([POINTS, [[1.0, 2.0, 3.0]]])
    assert adjust(views, lonely, tracks).points[-1].tolist() == [1.0, 2.0, 3.0]
