"""Lengths, areas and normals of triangles against values by hand."""

import numpy as np
import pytest

from restore.mesh.measures import (
    edge_strain,
    face_normals,
    face_signs,
    flipped_faces,
    signed_areas,
    straight_lengths,
    surface_area,
)

SQUARE = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0], [3.0, 4.0]])
FACES = np.array([[0, 1, 2], [1, 3, 2]])
EXACT = 1e-12
PARITY = 1e-9


def test_strain_is_the_relative_change_of_length():
    edges = np.array([[0, 1], [0, 2], [1, 2]])
    np.testing.assert_allclose(edge_strain(SQUARE, edges, np.array([3.0, 4.0, 4.0])), [0.0, 0.0, 0.25], atol=EXACT)
    np.testing.assert_allclose(edge_strain(0.99 * SQUARE, edges, np.array([3.0, 4.0, 5.0])), -0.01, atol=EXACT)


def test_areas_are_negative_where_a_face_is_flipped():
    np.testing.assert_allclose(signed_areas(SQUARE, FACES), [6.0, 6.0])
    np.testing.assert_allclose(signed_areas(SQUARE, FACES[:, ::-1]), [-6.0, -6.0])
    np.testing.assert_allclose(signed_areas(SQUARE * [-1, 1], FACES), [-6.0, -6.0])


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_faces_against_most_of_the_area_are_inverted(mirror):
    strip = np.stack(np.meshgrid(np.arange(6.0), [0.0, 1.0]), axis=-1).reshape(-1, 2)
    k = np.arange(5)
    faces = np.vstack([np.column_stack([k, k + 1, k + 6]), np.column_stack([k + 1, k + 7, k + 6])])
    assert flipped_faces(strip * [mirror, 1], faces) == 0
    folded = strip.copy()
    folded[5] = [3.5, 1.5]  # the lower right corner, over its neighbours
    assert flipped_faces(folded * [mirror, 1], faces) == 2
    flat = strip.copy()
    flat[0] = flat[1]  # a face without area has no side
    assert flipped_faces(flat * [mirror, 1], faces) == 0


def test_the_area_of_a_warped_surface():
    roof = np.array([[0, 0, 0], [3, 0, 4], [6, 0, 0], [0, 2, 0], [3, 2, 4], [6, 2, 0]], float)
    faces = np.array([[0, 1, 3], [1, 4, 3], [1, 2, 4], [2, 5, 4]])
    assert surface_area(roof, faces) == pytest.approx(20.0)
    assert surface_area(roof, faces[:, ::-1]) == pytest.approx(20.0)


def test_the_area_of_triangles_in_space_and_projected():
    corners = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, 4.0], [0.0, 2.0, 0.0]])
    faces = np.array([[0, 1, 2], [0, 1, 3]])
    assert surface_area(corners, faces) == pytest.approx(6.0 + 3.0)
    assert surface_area(corners[:, :2].copy(), faces) == pytest.approx(3.0)


def test_normals_are_twice_as_long_as_the_areas():
    corners = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, 4.0], [0.0, 2.0, 0.0]])
    faces = np.array([[0, 1, 2], [0, 1, 3], [1, 2, 3]])
    a, b, c = (corners[faces[:, k]] for k in range(3))
    np.testing.assert_allclose(face_normals(corners, faces), np.cross(b - a, c - a), atol=EXACT)


@pytest.mark.parametrize(
    "kernel, work",
    [
        (straight_lengths, (SQUARE, np.array([[0, 1], [0, 2], [1, 2]]))),
        (signed_areas, (SQUARE, FACES)),
        (surface_area, (SQUARE, FACES)),
        (face_normals, (np.column_stack([SQUARE, [1.0, 2.0, 0.0, 5.0]]), FACES)),
    ],
)
def test_compiled_and_plain_python_agree(kernel, work):
    np.testing.assert_allclose(kernel(*work), kernel.py_func(*work), atol=PARITY)


@pytest.mark.parametrize("turn", [0.0, 1.0, 2.0])
def test_a_face_folded_over_in_space_has_a_negative_sign(warped, turn):
    page = warped("curl", count=300)
    vertices, faces = page.mesh.vertices.copy(), page.mesh.faces
    middle = int(np.argmin(np.linalg.norm(page.flat, axis=1)))
    face = int(next(f for f in range(len(faces)) if middle in faces[f]))
    assert (face_signs(vertices, faces) == 1).all()
    others = faces[face][faces[face] != middle]
    vertices[middle] += 1.5 * (vertices[others].mean(axis=0) - vertices[middle])
    cos, sin = np.cos(turn), np.sin(turn)
    vertices = vertices @ np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    assert face_signs(vertices, faces)[face] == -1
    assert (face_signs(vertices, faces) == -1).sum() == 1


def test_what_is_known_of_signs_turns_the_normals_that_others_are_told_by(warped):
    page = warped("curl", count=300)
    reversed_all_round = -np.ones(len(page.mesh.faces))
    signs = face_signs(page.mesh.vertices, page.mesh.faces, reversed_all_round)
    np.testing.assert_array_equal(signs, reversed_all_round)
    alone = reversed_all_round.copy()
    alone[int(np.argmin(np.linalg.norm(page.flat[page.mesh.faces].mean(axis=1), axis=1)))] = 1.0
    np.testing.assert_array_equal(face_signs(page.mesh.vertices, page.mesh.faces, alone), reversed_all_round)


@pytest.mark.parametrize("fold_deg", [0.0, 80.0, 100.0, 120.0])
def test_a_dog_ear_that_is_folded_up_is_not_folded_over(fold_deg):
    """Its lengths do not tell, and of two faces neither is the witness of the other."""
    fold = np.deg2rad(fold_deg)
    page = np.array([[0, 0, 0], [0, 1, 0], [-1, 0.5, 0], [np.cos(fold), 0.5, np.sin(fold)]])
    assert (face_signs(page, np.array([[0, 1, 2], [1, 0, 3]])) == 1).all()
