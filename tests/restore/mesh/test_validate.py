"""A valid mesh is one by construction: bad arrays are refused, faces are oriented, derived tables are its own."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from oracles.markers import rigid_residual
from restore import flatten
from restore.errors import BadInput, NotEnoughSurface
from restore.mesh.adjacency import sides_of
from restore.mesh.measures import face_normals, straight_lengths
from restore.mesh.ordered_grid import grid_faces
from restore.mesh.validate import ValidMesh, _improper, validated
from restore.scan import SurfaceMesh

QUAD = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]])
EXACT_MM = 1e-4  # of a page of 5 mm
TWO = np.array([[0, 1, 2], [0, 2, 3]])


def test_a_valid_mesh_is_made_once():
    mesh = validated(SurfaceMesh(QUAD, TWO))
    assert validated(mesh) is mesh


def test_it_carries_the_sides_and_the_normals_of_its_faces():
    mesh = validated(SurfaceMesh(QUAD, TWO))
    for mine, computed in zip(mesh.topology.sides, sides_of(TWO), strict=True):
        np.testing.assert_array_equal(mine, computed)
    np.testing.assert_array_equal(mesh.normals, face_normals(QUAD, TWO))


def test_a_face_that_runs_against_its_neighbour_is_turned_round():
    mesh = validated(SurfaceMesh(QUAD, np.array([[0, 1, 2], [0, 3, 2]])))
    assert abs(np.sign(mesh.normals[:, 2]).sum()) == 2


def test_replacing_the_vertices_recomputes_the_normals():
    mesh = replace(validated(SurfaceMesh(QUAD, TWO)), vertices=QUAD[:, [0, 2, 1]])
    assert isinstance(mesh, ValidMesh)
    np.testing.assert_array_equal(mesh.normals, face_normals(QUAD[:, [0, 2, 1]], TWO))


def test_replacing_the_faces_checks_them():
    with pytest.raises(BadInput, match="vertices it does not have"):
        replace(validated(SurfaceMesh(QUAD, TWO)), faces=np.array([[0, 1, 9]]))


def test_a_face_that_names_a_vertex_twice_is_left_out():
    mesh = validated(SurfaceMesh(QUAD, np.concatenate([TWO, [[1, 1, 2]]])))
    np.testing.assert_array_equal(mesh.faces, TWO)


@pytest.mark.parametrize("copy", [[0, 1, 2], [1, 2, 0], [2, 1, 0]])
def test_of_several_faces_with_the_same_vertices_the_first_is_kept(copy):
    mesh = validated(SurfaceMesh(QUAD, np.concatenate([TWO, [copy]])))
    np.testing.assert_array_equal(mesh.faces, TWO)


@given(st.lists(st.tuples(*[st.integers(0, 4)] * 3), min_size=1, max_size=12))
def test_of_any_faces_those_with_a_vertex_twice_and_all_copies_but_the_first_are_left_out(faces):
    met, wanted = set(), []
    for face in map(frozenset, faces):
        wanted.append(len(face) < 3 or face in met)
        met.add(face)
    np.testing.assert_array_equal(_improper(np.array(faces), sides_of(np.array(faces))), wanted)


@pytest.mark.parametrize("fold_deg", [70.0, 110.0, 170.0])
@pytest.mark.parametrize("down_first", [False, True])
def test_a_flap_with_two_sides_lies_where_it_does_in_space(fold_deg, down_first):
    """A decimator leaves both sides of a flap on an edge within the page; lengths do not tell to which side it lies."""
    across, down = np.meshgrid(np.arange(6.0), np.arange(6.0, 0.0, -1.0))
    page = np.stack([across.ravel(), down.ravel(), np.zeros(36)], axis=1)
    left, right = 14, 15  # an edge along x
    fold = np.deg2rad(fold_deg)
    tip = (page[left] + page[right]) / 2 + [0.1, 0.8 * np.cos(fold), 0.8 * np.sin(fold)]
    up, under = [left, right, 36], [right, left, 36]
    flap = [under, up] if down_first else [up, under]
    mesh = validated(SurfaceMesh(np.vstack([page, tip]), np.concatenate([grid_faces(np.ones((6, 6), bool)), flap])))
    assert len(mesh.faces) == 51
    flat = np.vstack([page[:, :2], page[[left, right], :2].mean(axis=0) + [0.1, 0.8 * np.sign(np.cos(fold))]])
    lengths = straight_lengths(flat, mesh.topology.edges)
    rest, _ = rigid_residual(flatten(mesh, lengths=lengths).flat, flat)
    assert np.abs(rest).max() < EXACT_MM


@given(st.lists(st.tuples(*[st.integers(0, 5)] * 3), min_size=1, max_size=40))
def test_of_any_faces_the_first_of_every_three_vertices_is_kept(drawn):
    faces, kept, met = np.array(drawn), [], set()
    for face in drawn:
        if len(set(face)) == 3 and frozenset(face) not in met:
            kept.append(sorted(face))
            met.add(frozenset(face))
    if kept:
        corners = np.random.default_rng(0).normal(size=(6, 3))
        assert np.sort(validated(SurfaceMesh(corners, faces)).faces, axis=1).tolist() == kept


def test_a_hundred_thousand_copies_are_left_out():
    assert validated(SurfaceMesh(QUAD, np.tile([[0, 1, 2]], (100_000, 1)))).faces.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize(
    "doubled",
    [
        lambda faces: np.tile(faces, (2, 1)),
        lambda faces: np.repeat(faces, 2, axis=0),
        lambda faces: np.concatenate([faces, faces[:, ::-1]]),
    ],
)
def test_a_mesh_whose_faces_are_all_there_twice_keeps_the_side_that_comes_first(warped, doubled):
    """However it lies in space: nothing beside its faces is there to tell, but what rounding leaves."""
    mesh = replace(warped(count=400).mesh, texcoords=None, texture=None)
    for turn in Rotation.random(8, random_state=0):
        turned = SurfaceMesh(turn.apply(mesh.vertices), doubled(mesh.faces))
        assert (validated(turned).faces == mesh.faces).all()


@pytest.mark.parametrize("kind", [np.float32, np.int32])
def test_other_types_of_numbers_become_the_declared_ones(kind):
    mesh = validated(SurfaceMesh(QUAD.astype(kind), TWO.astype(np.uint32)))
    assert (mesh.vertices.dtype, mesh.faces.dtype) == (np.float64, np.int64)


@pytest.mark.parametrize(
    ("vertices", "faces", "texcoords", "error", "message"),
    [
        (QUAD, np.empty((0, 3), int), None, NotEnoughSurface, "no faces"),
        (QUAD * np.nan, TWO, None, BadInput, "not finite"),
        (QUAD * 1e150, TWO, None, BadInput, "beyond every page"),
        (QUAD, TWO + 9, None, BadInput, "vertices it does not have"),
        (QUAD, TWO - 1, None, BadInput, "vertices it does not have"),
        (QUAD, TWO, np.zeros((3, 2)), BadInput, "no texture coordinate"),
        (QUAD * [1, 0, 0], TWO, None, NotEnoughSurface, "have no area"),
        (QUAD[:, :2], TWO, None, BadInput, "not triangles in space"),
        (QUAD, np.array([[0, 1, 2, 3]]), None, BadInput, "not triangles in space"),
        (QUAD, TWO.astype(float), None, BadInput, "whole numbers of vertices"),
    ],
)
def test_what_is_not_a_mesh_is_refused_with_the_reason(vertices, faces, texcoords, error, message):
    with pytest.raises(error) as caught:
        validated(SurfaceMesh(vertices, faces, texcoords))
    assert message in f"{caught.value} {caught.value.hint}"
