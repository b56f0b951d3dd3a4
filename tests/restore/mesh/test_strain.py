"""Stretch and shear of faces against maps whose principal stretches are known."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from restore import SurfaceMesh, flatten
from restore.mesh.measures import straight_lengths
from restore.mesh.strain import average_at_vertices, face_strain, smooth_rms_strain
from restore.mesh.topology import Topology
from restore.mesh.triangulate import lattice
from restore.prepared.description import NOT_DEVELOPABLE

SQUARE = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0], [3.0, 4.0]])
FACES = np.array([[0, 1, 2], [1, 3, 2]])
SECOND_ORDER = 1e-3  # strains of 2 % squared, and what holds loose cells
LENGTHS = np.array([3.0, 4.0, 5.0, 4.0, 3.0])  # of the edges of the rectangle and its diagonal
EDGES = np.array([[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]])
angles, factors = st.floats(-np.pi, np.pi), st.floats(0.5, 2.0)


@given(angles, angles, factors, factors)
def test_stretch_and_shear_are_those_of_the_principal_stretches(before, after, first, second):
    def turn(angle):
        return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    flat = SQUARE @ (turn(after) @ np.diag([first, second]) @ turn(before)).T
    expected = [np.sqrt(first * second) - 1.0, abs(first - second) / 2.0]
    np.testing.assert_allclose(face_strain(flat, FACES, EDGES, LENGTHS), [expected, expected], atol=1e-7)


def test_a_face_without_area_has_finite_strain():
    lengths = np.array([3.0, 4.0, 7.0, 4.0, 3.0])
    assert np.isfinite(face_strain(SQUARE, FACES, EDGES, lengths)).all()


def test_lengths_that_no_triangle_has_are_strained_the_same_whatever_corner_comes_first():
    lengths = np.array([3.0, 4.0, 7.5, 4.0, 3.0])
    strain = face_strain(SQUARE, FACES, EDGES, lengths)
    for turn in (1, 2):
        np.testing.assert_allclose(face_strain(SQUARE, np.roll(FACES, turn, axis=1), EDGES, lengths), strain)


def test_the_value_at_a_vertex_is_the_mean_of_its_faces():
    values = average_at_vertices(np.array([[1.0, 0.0], [3.0, 2.0]]), FACES, 5)
    np.testing.assert_allclose(values, [[1, 0], [2, 1], [2, 1], [3, 2], [0, 0]])


def sheet():
    """A lattice of 120 × 80 mm: flat (n, 2), faces, edges and their lengths."""
    nodes, faces = lattice(np.ones((81, 121), bool), 2)
    flat, edges = nodes[:, ::-1].astype(float), Topology(faces).edges
    return flat, faces, edges, straight_lengths(flat, edges)


@given(st.floats(-0.02, 0.02), st.floats(-0.02, 0.02), angles)
def test_an_even_strain_is_the_smooth_strain(first, second, turn):
    flat, _, edges, lengths = sheet()
    axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    stretched = flat @ axes.T @ np.diag([1.0 + first, 1.0 + second]) @ axes
    over_all_ways = np.sqrt((3 * first**2 + 3 * second**2 + 2 * first * second) / 8)
    assert abs(smooth_rms_strain(stretched, edges, lengths) - over_all_ways) < SECOND_ORDER


def test_wrong_lengths_of_single_edges_are_hardly_smooth_strain(rng):
    flat, _, edges, lengths = sheet()
    wrong = np.where(rng.random(len(lengths)) < 0.02, rng.choice([0.8, 1.2], len(lengths)), 1.0)
    assert np.sqrt(np.mean((1 / wrong - 1) ** 2)) > 5 * NOT_DEVELOPABLE
    assert smooth_rms_strain(flat, edges, wrong * lengths) < NOT_DEVELOPABLE


def test_a_dome_is_strained_smoothly():
    flat, faces, _, _ = sheet()
    height = 20.0 * np.exp(-((flat - flat.mean(axis=0)) ** 2).sum(axis=1) / (2 * 30.0**2))
    page = flatten(SurfaceMesh(np.column_stack([flat, height]), faces))
    assert smooth_rms_strain(page.flat, Topology(page.faces).edges, page.lengths) > NOT_DEVELOPABLE


def test_a_page_that_has_collapsed_is_strained_wholly():
    flat, _, edges, lengths = sheet()
    assert abs(smooth_rms_strain(np.zeros_like(flat), edges, lengths) - 1) < 2 * SECOND_ORDER
