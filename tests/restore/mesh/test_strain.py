"""Stretch and shear of faces against maps whose principal stretches are known."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from restore.mesh.strain import average_at_vertices, face_strain

SQUARE = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0], [3.0, 4.0]])
FACES = np.array([[0, 1, 2], [1, 3, 2]])
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


def test_the_value_at_a_vertex_is_the_mean_of_its_faces():
    values = average_at_vertices(np.array([[1.0, 0.0], [3.0, 2.0]]), FACES, 5)
    np.testing.assert_allclose(values, [[1, 0], [2, 1], [2, 1], [3, 2], [0, 0]])
