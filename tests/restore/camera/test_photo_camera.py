"""The camera that a photograph is found to have."""

import cv2
import numpy as np
import pytest

from restore.camera import photo_camera as module
from restore.camera.photo_camera import PhotoCamera, project_with_jacobian

EXACT_PX = 1e-8
SLOPE = 1e-4  # of a derivative, by differences
VECTOR = np.array([0.2, -0.1, 0.4, 30.0, -20.0, 1500.0, 2500.0, 999.0, 701.0, -0.1, 0.05, 0.001, -0.002, 0.01])


@pytest.fixture
def camera():
    return PhotoCamera(VECTOR, (2000, 1400))


@pytest.fixture
def points(rng):
    return rng.uniform(-150, 150, (40, 3)) + [0, 0, -900.0 + 900.0]


def test_projection_is_that_of_opencv(camera, points):
    matrix = np.array([[2500.0, 0, 999], [0, 2500.0, 701], [0, 0, 1]])
    expected, _ = cv2.projectPoints(points, VECTOR[:3], VECTOR[3:6], matrix, VECTOR[9:])
    np.testing.assert_allclose(camera.project(points), expected[:, 0], atol=EXACT_PX)
    np.testing.assert_allclose(project_with_jacobian(VECTOR, points)[0], expected[:, 0], atol=EXACT_PX)


def test_the_compiled_projection_agrees_with_plain_python(camera, points):
    arguments = points, camera.rotation, camera.vector, camera.reach
    np.testing.assert_allclose(module._project(*arguments), module._project.py_func(*arguments), rtol=1e-12)


def test_derivatives(points):
    _, slopes = project_with_jacobian(VECTOR, points)
    for k, step in enumerate([1e-6] * 3 + [1e-3] * 6 + [1e-6] * 5):
        moved = VECTOR.copy()
        moved[k] += step
        expected = (project_with_jacobian(moved, points)[0] - project_with_jacobian(VECTOR, points)[0]) / step
        np.testing.assert_allclose(slopes[..., k], expected, rtol=SLOPE, atol=SLOPE * np.abs(slopes[..., k]).max())


def test_what_lies_behind_or_where_the_lens_folds_over_is_not_seen(camera):
    behind = camera.position - 100 * camera.rotation[2]
    assert np.isnan(camera.project(behind[None])).all()
    folding = PhotoCamera(np.where(np.arange(14) == 9, -1.0, VECTOR) * (np.arange(14) < 10), (2000, 1400))
    assert folding.reach == pytest.approx(1 / 3)  # r·(1 − r²) turns at r² = 1/3
    ahead = folding.position + 100 * folding.rotation[2]
    sideways = ahead + 60 * folding.rotation[0]
    assert np.isfinite(folding.project(ahead[None])).all()
    assert np.isnan(folding.project(sideways[None])).all()


def test_the_same_photograph_at_another_size(camera, points):
    half = camera.scaled((1000, 700))
    np.testing.assert_allclose(half.project(points), (camera.project(points) + 0.5) / 2 - 0.5, atol=EXACT_PX)
