"""The mesh of a page is as large as its outline, on average over where the lattice happens to lie."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from restore.mesh.measures import surface_area
from restore.photogrammetry.mesh import VERTICES, mesh_within, stretch
from restore.photogrammetry.surface import Surface

EXACT = 1e-4  # chords of a curl of 50 mm, a vertex to 0.6 mm
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


def test_a_lattice_that_is_torn_is_stretched_by_the_area_of_the_tear():
    vertices, faces = mesh_within(PLANE, outline(0.0))
    assert stretch(vertices, faces) == pytest.approx(0.0, abs=EXACT)
    bent = np.column_stack([50 * np.sin(vertices[:, 0] / 50), vertices[:, 1], 50 * np.cos(vertices[:, 0] / 50)])
    assert stretch(bent, faces) == pytest.approx(0.0, abs=EXACT)
    torn = vertices + np.where(vertices[:, :1] > 7.0, [4.0, 0.0, 0.0], 0.0)
    assert stretch(torn, faces) == pytest.approx(4.0 / 200.0, rel=0.02)
