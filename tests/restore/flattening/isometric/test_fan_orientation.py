"""Signs of faces from lengths alone: wrong ones, one or several round a vertex, are given away by fans left open."""

from importlib import import_module
from itertools import combinations, pairwise

import numpy as np
import pytest

from restore.flattening.isometric.fan_orientation import MAX_WAYS, closing_signs, orient_by_fans
from restore.mesh.adjacency import sides_of
from restore.mesh.measures import signed_areas, straight_lengths
from restore.mesh.network import make_network
from restore.mesh.topology import Topology


def closed(flat, faces, lengths, signs):
    """The likeliest signs of faces, of a page whose normals tell of all that no fan does."""
    network = make_network(flat, Topology(faces), lengths)
    return next(closing_signs(np.column_stack([flat, np.zeros(len(flat))]), network, signs))


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
    np.testing.assert_array_equal(closed(flat, faces, lengths, true), true)
    inner = np.flatnonzero((np.abs(flat[faces]) < [100, 70]).all(axis=(1, 2)))  # at the border fans need not close
    for wrong in rng.choice(inner, 20, replace=False):
        signs = true.copy()
        signs[wrong] = -signs[wrong]
        np.testing.assert_array_equal(closed(flat, faces, lengths, signs), true)


def test_two_neighbours_with_each_other_s_signs_are_given_away(warped):
    flat, faces, true, sides = folded_over(warped)
    lengths = straight_lengths(flat, sides.edges)
    adjacent = [sides.at[a:b] // 3 for a, b in pairwise(sides.first) if b - a == 2]
    swapped = [pair for pair in adjacent if true[pair].sum() == 0]
    assert swapped
    for pair in swapped:
        signs = true.copy()
        signs[pair] = -signs[pair]
        np.testing.assert_array_equal(closed(flat, faces, lengths, signs), true)


def test_three_wrong_signs_round_a_vertex_are_given_away(warped, rng):
    flat, faces, true, sides = folded_over(warped)
    lengths = straight_lengths(flat, sides.edges)
    inner = np.flatnonzero((np.abs(flat) < [80, 50]).all(axis=1))
    repaired = list[bool]()
    for vertex in rng.choice(inner, 20, replace=False):
        for wrong in combinations(np.flatnonzero((faces == vertex).any(axis=1)), 3):
            signs = true.copy()
            signs[list(wrong)] *= -1.0
            repaired.append((closed(flat, faces, lengths, signs) == true).all())
    assert np.mean(repaired) > 0.99  # now and then others close the fans as well


def test_wrong_signs_all_round_a_vertex_are_distinguished_from_a_sheet_without_folds(warped):
    page = warped(count=400)
    faces, sides = page.mesh.faces, sides_of(page.mesh.faces)
    middle = int(np.argmin(np.linalg.norm(page.flat, axis=1)))
    ring = np.unique(faces[(faces == middle).any(axis=1)])
    signs = np.where(np.isin(faces, ring).sum(axis=1) >= 2, -1.0, 1.0)
    found = closed(page.flat, faces, straight_lengths(page.flat, sides.edges), signs)
    np.testing.assert_array_equal(found, np.ones(len(faces)))


def test_what_closes_by_no_more_than_chance_turns_no_sign(warped, rng):
    page = warped(count=400)
    faces, sides = page.mesh.faces, sides_of(page.mesh.faces)
    noisy = straight_lengths(page.flat, sides.edges) * np.exp(0.01 * rng.normal(size=len(sides.edges)))
    upright = np.ones(len(faces))
    np.testing.assert_array_equal(closed(page.flat, faces, noisy, upright), upright)


def test_faces_in_the_corner_of_a_grid_keep_their_signs_however_their_only_fan_is_open():
    x, y = np.meshgrid(np.arange(9.0), np.arange(7.0))
    flat = np.stack([x.ravel(), y.ravel()], axis=1)
    squares = np.array([[0, 1, 10], [0, 10, 9]]), np.array([[0, 1, 9], [1, 10, 9]])
    faces = np.concatenate([squares[(row + i) % 2] + 9 * row + i for row in range(6) for i in range(8)])
    sides, upright = sides_of(faces), np.ones(len(faces))
    lengths = straight_lengths(flat, sides.edges)
    diagonal = np.isin(sides.edges, [0, 10, 20]).all(axis=1)
    bent = np.where(diagonal, 1.001 * lengths, lengths)
    # Four faces that have half of the angle round vertex 10, and no other inner corner, would close its fan.
    np.testing.assert_array_equal(closed(flat, faces, bent, upright), upright)


@pytest.mark.parametrize("count", [12, 13], ids=["all ways are tried", "too many faces: its neighbours tell"])
def test_a_wrong_sign_is_found_round_a_vertex_of_many_faces(count, rng):
    assert MAX_WAYS == 1 << 11  # those of twelve faces
    flat, faces = rings_round_a_vertex(count, rng)
    sides, signs = sides_of(faces), np.ones(len(faces))
    signs[count // 2] = -1.0
    assert 0 in faces[count // 2]
    found = closed(flat, faces, straight_lengths(flat, sides.edges), signs)
    np.testing.assert_array_equal(found, np.ones(len(faces)))


def test_signs_are_offered_by_the_normals_then_upright_in_groups_and_then_all_upright(warped):
    flat, faces, true, sides = folded_over(warped)
    network = make_network(flat, Topology(faces), straight_lengths(flat, sides.edges))
    offered = list(closing_signs(np.column_stack([flat, np.zeros(len(flat))]), network, np.ones(len(faces))))
    np.testing.assert_array_equal(offered, [true, true, np.ones(len(faces))])


def test_a_face_in_the_corner_is_in_no_fan(warped):
    page = warped(count=400)
    flat, faces = page.folded_over(), page.mesh.faces
    sides, corners = sides_of(faces), np.bincount(faces.ravel()) == 1
    assert corners.any()
    _, group = orient_by_fans(faces, sides, straight_lengths(flat, sides.edges), np.ones(len(faces)))
    alone = np.bincount(group)[group] == 1
    np.testing.assert_array_equal(alone[corners[faces].any(axis=1)], True)
    assert alone.mean() < 0.02


@pytest.mark.parametrize("rounded", [np.float64, np.float32])
def test_a_grid_with_a_fifth_of_its_signs_wrong_is_put_right(rng, rounded):
    """Its right angles close many fans in several ways, and more than half of all fans are open."""
    x, y = np.meshgrid(5.0 * np.arange(30.0), 5.0 * np.arange(20.0))
    flat = np.stack([x.ravel(), y.ravel()], axis=1) + rng.uniform(-2.0, 2.0, (600, 2))
    corner = (np.arange(19)[:, None] * 30 + np.arange(29)).ravel()
    faces = np.concatenate([corner[:, None] + [0, 1, 31], corner[:, None] + [0, 31, 30]])
    true = np.sign(signed_areas(flat, faces))
    inner = ((flat[faces].mean(axis=1) > 10.0) & (flat[faces].mean(axis=1) < [135.0, 85.0])).all(axis=1)
    signs = np.where(inner & (rng.random(len(faces)) < 0.2), -true, true)
    lengths = straight_lengths(flat, sides_of(faces).edges).astype(rounded).astype(float)
    np.testing.assert_array_equal(closed(flat, faces, lengths, signs), true)


def rings_round_a_vertex(count, rng):
    """Flat (n, 2) and faces (m, 3): a vertex with `count` neighbours unevenly round it, and two rings round those."""
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False) + 0.3 / count * rng.random((3, count))
    rings = np.arange(1.0, 4.0)[:, None, None] * np.stack([np.cos(angles), np.sin(angles)], axis=2)
    one, other = np.arange(count), (np.arange(count) + 1) % count
    faces = [np.stack([np.zeros(count, int), 1 + one, 1 + other], axis=1)]
    for inner, outer in ((1, 1 + count), (1 + count, 1 + 2 * count)):
        faces.append(np.stack([inner + one, outer + one, outer + other], axis=1))
        faces.append(np.stack([inner + one, outer + other, inner + other], axis=1))
    return np.vstack([np.zeros((1, 2)), rings.reshape(-1, 2)]), np.concatenate(faces)


@pytest.mark.parametrize("share", [0.05, 0.15])
def test_a_torn_mesh_with_a_tenth_of_its_signs_wrong_is_put_right(warped, rng, share):
    page = warped(count=1500)
    flat, faces, sides = page.flat.copy(), page.mesh.faces, sides_of(page.mesh.faces)
    inside = (np.abs(flat) < [120, 80]).all(axis=1)
    moved = inside & (rng.random(len(flat)) < share)
    flat[moved] += rng.normal(0.0, 8.0, (moved.sum(), 2))  # as far as to the next vertex
    true = np.sign(signed_areas(flat, faces))
    wrong = inside[faces].all(axis=1) & (rng.random(len(faces)) < 0.1)
    signs = np.where(wrong, -true, true)
    assert (true < 0.0).mean() > 0.5 * share
    found = closed(flat, faces, straight_lengths(flat, sides.edges), signs)
    np.testing.assert_array_equal(found, true)


def test_compiled_and_plain_python_agree(warped, plain):
    flat, faces, true, sides = folded_over(warped)
    lengths, signs = straight_lengths(flat, sides.edges), np.ones(len(faces))
    compiled = orient_by_fans(faces, sides, lengths, signs)
    assert {"_write_groups", "_ways", "_join"} <= set(
        plain(import_module("restore.flattening.isometric.fan_orientation"))
    )
    np.testing.assert_array_equal(orient_by_fans(faces, sides, lengths, signs), compiled)
    np.testing.assert_array_equal(closed(flat, faces, lengths, signs), true)
