"""Fans of known meshes: their directions, folded faces, and vertices where faces meet without a common edge."""

from importlib import import_module

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from restore.flattening.isometric.fans import _joints, _opposite, angle_fans
from restore.mesh.adjacency import components, sides_of
from restore.mesh.measures import signed_areas, straight_lengths

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


def test_a_vertex_where_two_squares_touch_has_two_fans():
    flat = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [2, 1], [2, 2], [1, 2]], float)
    fans = fans_of(flat, np.array([[0, 1, 2], [0, 2, 3], [2, 4, 5], [2, 5, 6]]))
    assert sorted(fans.owner) == [0, 1, 2, 2, 3, 4, 5, 6]


def test_an_edge_of_three_faces_joins_each_of_them_to_the_next():
    flat = np.array([[0, 0], [2, 0], [1, 1], [1, 2], [1, -1]], float)
    fans = fans_of(flat, np.array([[0, 1, 2], [0, 1, 3], [1, 0, 4]]))
    shared = [set(pair) == {0, 1} for pair in fans.ends.tolist()]
    assert sum(shared) == 5
    assert components(fans.fans, len(fans.owner)).max() == 0


@given(st.lists(st.tuples(*[st.integers(0, 6)] * 3), min_size=1, max_size=12))
def test_each_side_is_joined_to_the_one_before_it_at_its_edge(faces):
    """And one that no side runs back along, or that is not the first of its edge, to itself as well."""
    sides = sides_of(np.array(faces))
    begins = [vertex for face in faces for vertex in face]
    opposite, joints = [-1] * len(begins), []
    groups = [sides.at[a:b].tolist() for a, b in zip(sides.first[:-1], sides.first[1:], strict=True)]
    for group in groups:
        if len(group) == 2 and begins[group[0]] != begins[group[1]]:
            opposite[group[0]], opposite[group[1]] = group[1], group[0]
    for edge, group in enumerate(groups):
        for q, side in enumerate(group):
            if q == 0 or opposite[side] < 0:
                joints += [(edge, side, other) for other in group[max(0, q - 1) : q + 1]]
    np.testing.assert_array_equal(_opposite(np.array(faces), sides), opposite)
    np.testing.assert_array_equal(np.transpose(_joints(sides, np.array(opposite))), np.reshape(joints, (-1, 3)))


def test_compiled_and_plain_python_agree(warped, plain):
    page = warped("fold", count=80)
    compiled = fans_of(page.flat, page.mesh.faces)
    assert "_unfold_fans" in plain(import_module("restore.flattening.isometric.fans"))
    for one, other in zip(compiled, fans_of(page.flat, page.mesh.faces), strict=True):
        np.testing.assert_allclose(one, other, atol=ROUNDING)
