"""The mesh of a page is as large as its outline, on average over where the lattice happens to lie."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from restore.mesh.measures import surface_area
from restore.photogrammetry.mesh import VERTICES, mesh_within
from restore.photogrammetry.surface import Surface

PLANE = Surface.level(np.array([-120.0, -90.0]), np.array([120.0, 90.0]), 3.0)


def outline(angle: float, width: float = 200.0) -> np.ndarray:
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.array([width, 140.0]) / 2
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    sides = zip(corners, np.roll(corners, -1, axis=0), strict=True)
    return np.concatenate([np.linspace(a, b, 80)[:-1] for a, b in sides]) @ turn.T


@pytest.mark.parametrize("angle", [0.1, 0.3, -0.25])
def test_the_area_is_that_of_the_outline(angle):
    border = outline(angle)
    vertices, faces = mesh_within(PLANE, border)
    assert len(vertices) == pytest.approx(VERTICES, rel=0.02)
    # a lattice line more or less on one side would be 0.3 %
    assert surface_area(vertices, faces) == pytest.approx(cv2.contourArea(border.astype(np.float32)), rel=1e-3)
    np.testing.assert_allclose(vertices[:, 2], 3.0, atol=1e-6)


def test_faces_run_counter_clockwise_seen_from_above():
    vertices, faces = mesh_within(PLANE, outline(0.0))
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()
