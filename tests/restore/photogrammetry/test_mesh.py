"""The mesh of a page ends at its outline."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from restore.mesh.measures import surface_area
from restore.photogrammetry.mesh import VERTICES, mesh_within, stretch
from restore.photogrammetry.surfaces.surface import Surface

EXACT = 1e-4  # chords of a curl of 50 mm, a vertex to 0.6 mm
PLANE = Surface.level(np.array([-120.0, -90.0]), np.array([120.0, 90.0]), 3.0)


def outline(angle: float, width: float = 200.0) -> np.ndarray:
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.array([width, 140.0]) / 2
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    sides = zip(corners, np.roll(corners, -1, axis=0), strict=True)
    return np.concatenate([np.linspace(a, b, 80)[:-1] for a, b in sides]) @ turn.T


def wavy() -> np.ndarray:
    """An outline that turns inwards as well, its points as far apart as those of an edge."""
    turn = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    return np.column_stack([100 * np.cos(turn) * (1 + 0.02 * np.sin(23 * turn)), 70 * np.sin(turn)])


@pytest.mark.slow
@pytest.mark.parametrize("border", [outline(0.0), outline(0.1), outline(-0.25), wavy()])
def test_the_area_is_that_of_the_outline(border):
    vertices, faces, places = mesh_within(PLANE, border)
    assert len(vertices) == pytest.approx(VERTICES, rel=0.02)
    # contourArea counts in single precision
    assert surface_area(vertices, faces) == pytest.approx(cv2.contourArea(border.astype(np.float32)), rel=1e-6)
    np.testing.assert_allclose(vertices, np.column_stack([places, np.full(len(places), 3.0)]), atol=1e-6)


@pytest.mark.parametrize("border", [outline(0.1), wavy()])
def test_the_mesh_is_one_sheet_whose_border_goes_through_the_outline(border):
    vertices, faces, _ = mesh_within(PLANE, border)
    assert (np.unique(faces) == np.arange(len(vertices))).all()
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    once = (counted := np.unique(edges, axis=0, return_counts=True))[0][counted[1] == 1]
    assert counted[1].max() == 2
    np.testing.assert_array_equal(np.unique(once), np.arange(len(once)))  # the first vertices, and no others
    assert cKDTree(vertices[once[:, 0], :2]).query(border)[0].max() < 1e-6


def test_faces_run_counter_clockwise_seen_from_above():
    vertices, faces, _ = mesh_within(PLANE, outline(0.0))
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_a_mesh_that_is_torn_is_stretched_by_the_area_of_the_tear():
    vertices, faces, places = mesh_within(PLANE, outline(0.0))
    corners = places[faces]
    assert stretch(vertices, faces, corners) == pytest.approx(0.0, abs=EXACT)
    bent = np.column_stack([50 * np.sin(vertices[:, 0] / 50), vertices[:, 1], 50 * np.cos(vertices[:, 0] / 50)])
    assert stretch(bent, faces, corners) == pytest.approx(0.0, abs=EXACT)
    torn = vertices + np.where(vertices[:, :1] > 7.0, [4.0, 0.0, 0.0], 0.0)
    assert stretch(torn, faces, corners) == pytest.approx(4.0 / 200.0, rel=0.02)
