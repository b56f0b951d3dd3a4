"""The edge of a page is found in space, although the surface it is looked for on is off."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from oracles.table_cameras import cameras, on_plane, picture
from restore.photogrammetry.edges import find_edge
from restore.photogrammetry.surface import Surface

HALF_MM = np.array([80.0, 55.0])
HEIGHT_MM = 6.0  # of the page over the table
PAPER, TABLE = 210.0, 120.0
ACCURACY_MM = 0.2  # a third of a pixel


@pytest.fixture(scope="module")
def greys():
    def light(origins, ways):
        page = (np.abs(on_plane(origins, ways, HEIGHT_MM)) < HALF_MM).all(axis=1)
        places = on_plane(origins, ways, 0.0)
        return np.where(page, PAPER, TABLE + 8 * np.sin(places[:, 1] / 2))

    return np.stack([cv2.GaussianBlur(picture(camera, light), (0, 0), 0.8) for camera in cameras()])


def level(height):
    return Surface.level(-HALF_MM - 30, HALF_MM + 30, height)


def rectangle(half):
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
    return np.concatenate(
        [np.linspace(a, b, 40)[:-1] for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    )


@pytest.mark.parametrize(("off_mm", "wider_mm"), [(0.0, 0.0), (2.0, 3.0), (-1.5, -4.0)])
def test_the_edge_is_found_in_space(greys, off_mm, wider_mm):
    edge = find_edge(greys, cameras(), level(HEIGHT_MM + off_mm), rectangle(HALF_MM + wider_mm))
    assert edge.measured.mean() > 0.8
    points = edge.points[edge.measured]
    np.testing.assert_allclose(edge.places, edge.points[:, :2], atol=1e-6)
    from_side = (HALF_MM - np.abs(points[:, :2])).min(axis=1)
    away_from_corners = (HALF_MM - np.abs(points[:, :2])).max(axis=1) > 8
    assert np.sqrt((from_side[away_from_corners] ** 2).mean()) < ACCURACY_MM
    assert np.sqrt(((points[away_from_corners, 2] - HEIGHT_MM) ** 2).mean()) < 3 * ACCURACY_MM


def test_no_step_no_edge(greys):
    blank = np.full_like(greys, 150.0)
    edge = find_edge(blank, cameras(), level(HEIGHT_MM), rectangle(HALF_MM))
    assert not edge.measured.any()
