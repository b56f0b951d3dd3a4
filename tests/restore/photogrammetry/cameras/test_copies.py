"""Smaller copies of photographs keep every place where the scaled camera sees it."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from restore.camera.photo_camera import PhotoCamera
from restore.photo.photograph import Photograph
from restore.photogrammetry.cameras.copies import smoothed_copies

SIZE = (1003, 757)  # no ratio makes both sides whole
SPOTS = np.array([[80.0, 60.0], [930.0, 70.0], [500.0, 380.0], [75.0, 700.0], [925.0, 690.0]])
SPREAD_PX = 6.0
SIDE = 601
EXACT_PX = 0.02  # of the centroid of a spot of 150 codes, rounded to whole ones


def spots() -> Photograph:
    x, y = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    light = sum(150.0 * np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * SPREAD_PX**2)) for u, v in SPOTS)
    return Photograph(np.repeat(np.rint(light).astype(np.uint8)[..., None], 3, axis=2))


def centroid(grey, place) -> np.ndarray:
    col, row = np.rint(place).astype(int)
    part = grey[row - 15 : row + 16, col - 15 : col + 16]
    y, x = np.mgrid[row - 15 : row + 16, col - 15 : col + 16]
    return np.array([(part * x).sum(), (part * y).sum()]) / part.sum()


def test_places_are_where_the_scaled_camera_sees_them():
    (copy,) = smoothed_copies([spots()], SIDE)
    assert max(copy.shape) == SIDE
    camera = PhotoCamera(np.array([0, 0, 0, 0, 0, 0, 900.0, 501.0, 378.0, 0, 0, 0, 0, 0]), SIZE)
    points = np.column_stack([(SPOTS - camera.vector[7:9]) / 900.0, np.ones(len(SPOTS))])
    np.testing.assert_allclose(camera.project(points), SPOTS)
    for place in camera.scaled(copy.shape[::-1]).project(points):
        np.testing.assert_allclose(centroid(copy, place), place, atol=EXACT_PX)


@pytest.mark.parametrize("side", [max(SIZE), 4000])
def test_no_copy_is_larger_than_its_photograph(side):
    photograph = spots()
    (copy,) = smoothed_copies([photograph], side)
    assert copy.shape == photograph.image.shape[:2]
    grey = cv2.cvtColor(photograph.image, cv2.COLOR_RGB2GRAY)
    assert copy.mean() == pytest.approx(grey.mean(), rel=1e-3)
