"""From edge lengths alone to the page: exact where the lengths are those of a flat page, wherever it hangs together."""

from heapq import heappop, heappush

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from restore.flattening.isometric.angle_synchronisation import along_tree, flat_from_lengths
from restore.flattening.isometric.fans import angle_fans
from restore.mesh.adjacency import adjacency, sides_of
from restore.mesh.measures import edge_strain, signed_areas, straight_lengths

EXACT = 1e-5  # strain: the matrix is grounded by a billionth, felt along the whole page
NOISE = 0.01  # of every length
NEAR_MM = 2.0  # of 280: what Gauss–Newton has to do from there


def solved(flat, faces, lengths=None):
    sides = sides_of(faces)
    lengths = straight_lengths(flat, sides.edges) if lengths is None else lengths
    fans = angle_fans(faces, sides, lengths, np.sign(signed_areas(flat, faces)))
    return flat_from_lengths(fans, lengths, len(flat)), sides.edges, lengths


@pytest.mark.parametrize("stretch", [1.0, 10.0])
def test_exact_lengths_give_the_page(warped, stretch):
    page = warped(count=500)
    found, edges, lengths = solved(page.flat * [stretch, 1.0], page.mesh.faces)
    assert np.abs(edge_strain(found, edges, lengths)).max() < stretch * EXACT
    assert (signed_areas(found, page.mesh.faces) > 0).all()


def test_a_page_with_a_hole_keeps_it(warped):
    page = warped(count=800)
    kept = np.linalg.norm(page.flat[page.mesh.faces].mean(axis=1), axis=1) > 40
    used, faces = np.unique(page.mesh.faces[kept], return_inverse=True)
    found, edges, lengths = solved(page.flat[used], faces.reshape(-1, 3).astype(np.int64))
    assert np.abs(edge_strain(found, edges, lengths)).max() < EXACT


def test_two_fans_at_a_pinched_vertex_do_no_harm(warped):
    """Two faces at a vertex that share no edge are missing: what is left there are two fans."""
    page = warped(count=800)
    middle = int(np.argmin(np.linalg.norm(page.flat, axis=1)))
    at_middle = np.flatnonzero((page.mesh.faces == middle).any(axis=1))
    first = at_middle[0]
    other = next(f for f in at_middle if len(np.intersect1d(page.mesh.faces[f], page.mesh.faces[first])) == 1)
    flat, faces = page.flat, np.delete(page.mesh.faces, [first, other], axis=0)
    sides = sides_of(faces)
    owners = angle_fans(faces, sides, straight_lengths(flat, sides.edges), np.ones(len(faces))).owner
    assert len(owners) > len(flat)
    found, edges, lengths = solved(flat, faces)
    assert np.abs(edge_strain(found, edges, lengths)).max() < EXACT


def test_halves_that_hang_together_by_one_edge_of_three_faces_lie_as_on_the_page():
    """Two strips of squares, one above the other, that have one edge in common, and a flap on it that lies on one."""
    x, y = np.meshgrid(np.arange(6.0), np.arange(2.0))
    strip = np.stack([x.ravel(), y.ravel()], axis=1)
    flat = np.vstack([strip, strip + [3.0, 1.0], [[3.7, 1.5]]])
    square = np.array([[0, 1, 7], [0, 7, 6]])
    below = np.concatenate([square + i for i in range(5)])
    above = below + 12
    above[above == 12], above[above == 13] = 9, 10  # (3, 1) and (4, 1), the ends of the edge
    used, faces = np.unique(np.concatenate([below, above, [[10, 9, 24]]]), return_inverse=True)
    found, edges, lengths = solved(flat[used], faces.reshape(-1, 3).astype(np.int64))
    assert np.abs(edge_strain(found, edges, lengths)).max() < EXACT
    apart = np.linalg.norm(found[0] - found[-2]), np.linalg.norm(flat[used][0] - flat[used][-2])
    assert apart[0] == pytest.approx(apart[1], rel=EXACT)


def test_many_short_joints_outvote_a_long_wrong_one():
    """As where Delaunay leaves long faces along straight borders, which cut through the windings of a rolled sheet."""
    frames = np.array([[0, 1], [1, 2], [3, 2], [0, 3], [5, 4]])
    turn, variances = np.array([0.1, 0.2, -0.4, 3.0, 0.3]), np.array([1.0, 1.0, 1.0, 25.0, 1.0])
    around = adjacency(frames.ravel(), np.repeat(np.arange(len(frames)), 2), 6)
    np.testing.assert_allclose(along_tree(frames, turn, variances, around), [0.0, 0.1, 0.3, 0.7, 0.0, -0.3])


JOINTS = st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9), st.integers(0, 3), st.integers(-9, 9)), max_size=40)


@given(JOINTS)
def test_the_tree_is_that_of_a_queue_from_which_the_least_variance_comes_first(joints):
    """Of two ways with the same variance the one to the frame of less number, then the one that turns less."""
    frames = np.array([joint[:2] for joint in joints], np.int64).reshape(-1, 2)
    variances, turn = np.array([joint[2:] for joint in joints], float).reshape(-1, 2).T
    around = adjacency(frames.ravel(), np.repeat(np.arange(len(frames)), 2), 10)
    wanted: dict[int, float] = {}
    for root in range(10):
        queue = [(0.0, root, 0.0)]
        while queue:
            variance, frame, turned = heappop(queue)
            if wanted.setdefault(frame, turned) is not turned:
                continue
            for (a, b), own, way in zip(frames.tolist(), variances, turn, strict=True):
                if a == frame or b == frame:
                    heappush(queue, (variance + own, a + b - frame, turned + (way if a == frame else -way)))
    np.testing.assert_array_equal(along_tree(frames, turn, variances, around), [wanted[i] for i in range(10)])


def test_lengths_with_errors_give_a_page_near_the_truth(warped):
    page = warped(count=800)
    sides = sides_of(page.mesh.faces)
    errors = np.random.default_rng(0).normal(1.0, NOISE, len(sides.edges))
    found, _, _ = solved(page.flat, page.mesh.faces, errors * straight_lengths(page.flat, sides.edges))
    assert page.error(found) < NEAR_MM
