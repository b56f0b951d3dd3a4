"""Fans of known meshes: their directions, folded faces, and vertices where faces meet without a common edge."""

from importlib import import_module
from itertools import pairwise

import numpy as np
import pytest

from restore.flattening.fans import angle_fans, closing_signs
from restore.mesh.adjacency import sides_of
from restore.mesh.measures import face_signs, signed_areas, straight_lengths

ROUNDING = 1e-9  # rad


def fans_of(flat, faces, signs=None):
    sides = sides_of(faces)
    signs = np.sign(signed_areas(flat, faces)) if signs is None else signs
    return angle_fans(faces, sides, straight_lengths(flat, sides.edges), signs)


def wrapped(angles):
    return (angles + np.pi) % (2 * np.pi) - np.pi


def frames(fans, flat):
    """For every fan the turns (·,) of its frame against the page, one from each of its joints."""
    found = [[] for _ in fans.owner]
    for (a, b), pair, angles in zip(fans.ends, fans.fans, fans.angles, strict=True):
        for end, way in ((0, flat[b] - flat[a]), (1, flat[a] - flat[b])):
            found[pair[end]].append(np.arctan2(way[1], way[0]) - angles[end])
    return found


def test_directions_of_a_flat_mesh_differ_from_the_true_ones_by_one_turn_for_each_fan(warped):
    page = warped(count=200)
    fans = fans_of(page.flat, page.mesh.faces)
    assert sorted(fans.owner) == list(range(len(page.flat)))
    assert len(fans.ends) == len(sides_of(page.mesh.faces).edges)
    for turns in frames(fans, page.flat):
        assert np.abs(wrapped(np.array(turns) - turns[0])).max() < ROUNDING


def test_a_folded_face_counts_backwards(warped):
    page = warped(count=200)
    flat, faces = page.folded_over(), page.mesh.faces
    assert (signed_areas(flat, faces) < 0).any()
    for turns in frames(fans_of(flat, faces), flat):
        assert np.abs(wrapped(np.array(turns) - turns[0])).max() < ROUNDING
    blind = frames(fans_of(flat, faces, np.ones(len(faces))), flat)
    assert max(np.abs(wrapped(np.array(turns) - turns[0])).max() for turns in blind) > 0.1


def folded_over(warped):
    """A page with a vertex moved over its opposite side: flat, faces, true signs, sides."""
    page = warped(count=400)
    flat, faces = page.folded_over(), page.mesh.faces
    true, sides = np.sign(signed_areas(flat, faces)), sides_of(faces)
    return flat, faces, true, sides


def test_fans_that_do_not_close_give_a_wrong_sign_away(warped, rng):
    flat, faces, true, sides = folded_over(warped)
    assert (true < 0).any()
    lengths = straight_lengths(flat, sides.edges)
    np.testing.assert_array_equal(closing_signs(faces, sides, lengths, true), true)
    inner = np.flatnonzero((np.abs(flat[faces]) < [100, 70]).all(axis=(1, 2)))  # at the border fans need not close
    for wrong in rng.choice(inner, 20, replace=False):
        signs = true.copy()
        signs[wrong] = -signs[wrong]
        np.testing.assert_array_equal(closing_signs(faces, sides, lengths, signs), true)


def test_two_neighbours_with_each_other_s_signs_are_given_away(warped):
    flat, faces, true, sides = folded_over(warped)
    lengths = straight_lengths(flat, sides.edges)
    beside = [sides.at[a:b] // 3 for a, b in pairwise(sides.first) if b - a == 2]
    swapped = [pair for pair in beside if true[pair].sum() == 0]
    assert swapped
    for pair in swapped:
        signs = true.copy()
        signs[pair] = -signs[pair]
        np.testing.assert_array_equal(closing_signs(faces, sides, lengths, signs), true)


def test_wrong_signs_all_round_a_vertex_are_told_from_a_sheet_without_folds(warped):
    page = warped(count=400)
    faces, sides = page.mesh.faces, sides_of(page.mesh.faces)
    middle = int(np.argmin(np.linalg.norm(page.flat, axis=1)))
    ring = np.unique(faces[(faces == middle).any(axis=1)])
    signs = np.where(np.isin(faces, ring).sum(axis=1) >= 2, -1.0, 1.0)
    found = closing_signs(faces, sides, straight_lengths(page.flat, sides.edges), signs)
    np.testing.assert_array_equal(found, np.ones(len(faces)))


def test_a_vertex_where_two_squares_touch_has_two_fans():
    flat = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [2, 1], [2, 2], [1, 2]], float)
    fans = fans_of(flat, np.array([[0, 1, 2], [0, 2, 3], [2, 4, 5], [2, 5, 6]]))
    assert sorted(fans.owner) == [0, 1, 2, 2, 3, 4, 5, 6]


def test_an_edge_of_three_faces_is_three_joints():
    flat = np.array([[0, 0], [2, 0], [1, 1], [1, 2], [1, -1]], float)
    fans = fans_of(flat, np.array([[0, 1, 2], [0, 1, 3], [1, 0, 4]]))
    assert sum(set(pair) == {0, 1} for pair in fans.ends) == 3


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


def test_compiled_and_plain_python_agree(warped, plain):
    page = warped("fold", count=80)
    compiled = fans_of(page.flat, page.mesh.faces)
    assert {"angle_fans", "_laid_out"} <= set(plain(import_module("restore.flattening.fans")))
    sides = sides_of(page.mesh.faces)
    lengths = straight_lengths(page.flat, sides.edges)
    plainly = angle_fans.py_func(page.mesh.faces, sides, lengths, np.ones(len(page.mesh.faces)))
    for one, other in zip(compiled, plainly, strict=True):
        np.testing.assert_allclose(one, other, atol=ROUNDING)
