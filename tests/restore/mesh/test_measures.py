"""Lengths, areas and normals of triangles against values by hand, and against loops that add in the same order."""

from math import sqrt

import numpy as np
import pytest

from restore.mesh.adjacency import sides_of
from restore.mesh.measures import (
    _set_angles,
    corner_angles,
    edge_strain,
    face_normals,
    face_signs,
    flipped_faces,
    signed_areas,
    straight_lengths,
    surface_area,
    vertex_normals,
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


def cross(u, v):
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def norm(vector):
    total = 0.0
    for x in vector:
        total += x * x
    return sqrt(total)


def loops(vertices, faces):
    """Lengths, areas in the plane, normals, their mean at the vertices and the whole area: one number at a time."""
    normals, around = [], [[0.0, 0.0, 0.0] for _ in vertices]
    for a, b, c in faces:
        normals.append(cross(vertices[b] - vertices[a], vertices[c] - vertices[a]))
        for i in (a, b, c):
            around[i] = [one + other for one, other in zip(around[i], normals[-1], strict=True)]
    flat_normals = (cross([*(p[b] - p[a]), 0.0], [*(p[c] - p[a]), 0.0]) for p in [vertices[:, :2]] for a, b, c in faces)
    return {
        "lengths": [norm(vertices[b] - vertices[a]) for a, b in sides_of(faces).edges],
        "areas": [0.5 * normal[2] for normal in flat_normals],
        "normals": normals,
        "vertex normals": [[x / norm(sums) for x in sums] for sums in around],
        "area": 0.5 * sum_one_by_one(norm(normal) for normal in normals),
    }


def sum_one_by_one(values):
    """The built-in sum corrects for rounding."""
    total = 0.0
    for value in values:
        total += value
    return total


def test_they_are_to_the_last_digit_what_loops_over_numbers_give(warped):
    page = warped("curl", count=300)
    vertices, faces = page.mesh.vertices, page.mesh.faces
    wanted = loops(vertices, faces)
    found = {
        "lengths": straight_lengths(vertices, sides_of(faces).edges),
        "areas": signed_areas(vertices[:, :2], faces),
        "normals": face_normals(vertices, faces),
        "vertex normals": vertex_normals(vertices, faces),
        "area": surface_area(vertices, faces),
    }
    for name, values in found.items():
        np.testing.assert_array_equal(values, wanted[name], name)


@pytest.mark.parametrize("far", [1e200, np.inf, np.nan])
def test_coordinates_without_bound_give_no_number_and_no_warning(far):
    vertices = np.array([[0.0, 0.0, 0.0], [far, 0.0, far], [0.0, far, -far]])
    faces = np.array([[0, 1, 2]])
    for measure in (surface_area, face_normals, vertex_normals):
        assert not np.isfinite(measure(vertices, faces)).all()
    assert not np.isfinite(signed_areas(vertices[:, :2], faces)).any()
    assert not np.isfinite(straight_lengths(vertices, np.array([[0, 1], [1, 2]]))).any()
    assert face_signs(vertices, faces).tolist() == [1.0]
    assert flipped_faces(vertices[:, :2], np.array([[0, 1, 2], [0, 2, 1]])) in (0, 1)


def test_the_angles_of_corners_are_those_between_their_sides(warped):
    page = warped(count=60)
    faces, flat = np.vstack([page.mesh.faces, [[0, 0, 1]]]), page.flat
    sides = sides_of(faces)
    lengths = straight_lengths(flat, sides.edges)
    found, plain = corner_angles(faces, sides, lengths), np.zeros(faces.size)
    for corner, (f, k) in enumerate(np.ndindex(faces.shape)):
        u, v = (flat[faces[f, (k + step) % 3]] - flat[faces[f, k]] for step in (1, 2))
        angle = 0.0 if f == len(faces) - 1 else np.arctan2(abs(u[0] * v[1] - u[1] * v[0]), u @ v)
        assert found[corner] == pytest.approx(angle, abs=PARITY)
    _set_angles.py_func(sides.edge, lengths, plain)
    np.testing.assert_allclose(found, plain, atol=PARITY)


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


def test_known_signs_orient_the_normals_of_others(warped):
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
