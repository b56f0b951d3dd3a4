"""The preconditioner: rigid aggregates solve exactly among rigid motions, the incomplete factor where edges are a tree.

Both together keep the passes few, whatever the page's size and however thin its faces.
"""

from importlib import import_module
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from restore.flattening.isometric.gauss_newton import _linearised, conjugate_gradients
from restore.flattening.isometric.preconditioner import (
    GROWTH,
    MODES,
    STIFFEN,
    correct_rigidly,
    precondition,
    prepared,
    rim_first,
    substitute,
)
from restore.mesh.topology import Topology

EXACT = 1e-4  # of the largest way: the stiffening of 1e-6 is felt where the page as a whole may move
PARITY = 1e-9
PRECISELY = 1e-3  # of the force is left, which is more than a step asks for
PASSES = 40  # pages of any size, whatever their faces, take 15 to 25


class System(NamedTuple):
    """The linear equations of a step at flat (n, 2), edges in the order of `rim_first`."""

    flat: np.ndarray
    edges: np.ndarray
    gradients: np.ndarray
    force: np.ndarray
    blocks: np.ndarray

    @property
    def prepared(self):
        return prepared(self.flat, self.edges, self.gradients, self.blocks)

    def solved_in(self, share):
        """How many passes leave the share of the force."""
        step = np.zeros_like(self.force)
        return conjugate_gradients(step, self.edges, self.gradients, self.force, self.prepared, share)

    @property
    def matrix(self):
        """(2n, 2n) the stiffness, dense."""
        ways = np.eye(2 * len(self.flat)).reshape(-1, 2, 2 * len(self.flat))
        strains = np.einsum("ek,ekm->em", self.gradients, ways[self.edges[:, 1]] - ways[self.edges[:, 0]])
        return strains.T @ strains


def system(flat, edges, lengths):
    vertices, order, edges = rim_first(flat, edges)
    gradients, force, blocks, _ = _linearised(
        flat[vertices], edges, 1.0 / lengths[order, None], np.ones(len(edges)), np.inf
    )
    return System(flat[vertices], edges, gradients, force, blocks)


@pytest.fixture(params=[60, 500, 2000])
def tilted(request, warped):
    """A page of several sizes with its sticks out of balance."""
    page = warped("gutter", count=request.param)
    flat = page.flat + np.random.default_rng(0).normal(0, 0.05, page.flat.shape)
    return system(flat, Topology(page.mesh.faces).edges, page.lengths)


def rigid_motions(aggregates):
    """(2n, MODES · k): how the particles go with every mode of every aggregate."""
    owner, arms = aggregates.owner, aggregates.arms
    motions = np.zeros((len(owner), 2, owner.max() + 1, MODES))
    every = np.arange(len(owner))
    motions[every, 0, owner, 0] = motions[every, 1, owner, 1] = 1.0
    motions[every, 0, owner, 2], motions[every, 1, owner, 2] = -arms[:, 1], arms[:, 0]
    return motions.reshape(2 * len(owner), -1)


def strains(edges, gradients, motions):
    """(e, ·): the strain of every stick under motions (2n, ·)."""
    moved = motions.reshape(-1, 2, motions.shape[1])
    return np.einsum("ek,ekm->em", gradients, moved[edges[:, 1]] - moved[edges[:, 0]])


def test_every_particle_has_an_aggregate_of_neighbours(tilted):
    flat, owner = tilted.flat, tilted.prepared.owner
    members = np.bincount(owner)
    assert (members > 0).all()
    wanted = len(flat) ** GROWTH
    assert 0.5 * wanted <= len(members) < 2.0 * wanted + 4  # at the rim cells are cut
    extent = max(np.ptp(flat[owner == k], axis=0).max() for k in range(len(members)))
    area = np.ptp(flat, axis=0).prod()
    assert extent < 2.0 * np.sqrt(area / wanted)


def test_the_way_balances_all_rigid_motions(tilted):
    aggregates, way = tilted.prepared, np.zeros_like(tilted.flat)
    work = correct_rigidly(aggregates, tilted.force, way)
    motions = rigid_motions(aggregates)
    strained = strains(tilted.edges, tilted.gradients, motions)
    stiffness = strained.T @ strained
    stiffness += STIFFEN * np.diag(np.diag(stiffness))
    exact = motions @ np.linalg.solve(stiffness, motions.T @ tilted.force.ravel())
    np.testing.assert_allclose(way.ravel(), exact, atol=EXACT * np.abs(exact).max())
    assert work == pytest.approx((tilted.force * way).sum(), rel=EXACT)
    assert work > 0


def test_where_edges_are_a_tree_the_factor_is_whole():
    """Nothing is left out then: each vertex has but one neighbour behind it when its turn comes."""
    flat = np.array([[0.0, 0.0], [3.0, 1.0], [5.0, 4.0], [-2.0, 3.0], [-4.0, 7.0]])
    tree = system(flat, np.array([[0, 1], [1, 2], [0, 3], [3, 4]]), np.full(4, 4.0))
    way = np.zeros_like(flat)
    work = substitute(tree.edges, tree.gradients, tree.prepared.inverse, tree.force, way)
    held = tree.matrix + np.diag(STIFFEN * np.repeat(np.trace(_blocks(tree.matrix), axis1=1, axis2=2), 2))
    np.testing.assert_allclose(held @ way.ravel(), tree.force.ravel(), atol=EXACT * np.abs(tree.force).max())
    assert work == pytest.approx((tree.force * way).sum(), rel=EXACT)


def _blocks(matrix):
    """(n, 2, 2) the diagonal blocks of a matrix (2n, 2n)."""
    own = np.arange(len(matrix) // 2)
    return matrix.reshape(len(own), 2, len(own), 2)[own, :, own, :]


def test_vertices_go_from_the_rim_inwards_and_edges_by_the_end_that_goes_last(warped):
    page = warped("gutter", count=60)
    edges = Topology(page.mesh.faces).edges
    vertices, order, ordered = rim_first(page.flat, edges)
    middle = page.flat.mean(axis=0)
    np.testing.assert_array_equal(
        vertices, sorted(range(len(page.flat)), key=lambda i: -np.hypot(*page.flat[i] - middle))
    )
    place = {int(vertex): k for k, vertex in enumerate(vertices)}
    ends = [tuple(sorted((place[int(a)], place[int(b)]), reverse=True)) for a, b in edges]
    wanted = sorted(range(len(edges)), key=lambda k: ends[k])
    np.testing.assert_array_equal(order, wanted)
    np.testing.assert_array_equal(ordered, [ends[k][::-1] for k in wanted])


@given(arrays(float, (30, 2), elements=st.floats(-1.0, 1.0)), st.integers(0, 10))
def test_it_never_pushes_back(flat, thin):
    """The factor of any triangles, needles and slivers too, is positive: the way goes along the force."""
    flat = flat * [1.0, 10.0**-thin]
    edges = np.unique(np.sort(np.random.default_rng(0).integers(0, 30, (80, 2)), axis=1), axis=0)
    edges = edges[edges[:, 0] != edges[:, 1]]
    net = system(flat, edges, np.full(len(edges), 0.5))
    force = np.random.default_rng(1).normal(size=flat.shape)
    assert precondition(net.prepared, net.edges, net.gradients, force, np.zeros_like(flat)) > 0.0


def test_a_page_that_is_turned_mirrored_or_renumbered_has_the_same_order_and_aggregates(warped, rng):
    page = warped("gutter", count=500)
    edges, angle, numbers = Topology(page.mesh.faces).edges, np.deg2rad(140.0), rng.permutation(len(page.flat))
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    moved = np.empty_like(page.flat)
    moved[numbers] = page.flat @ turn * [1.0, -1.0] + 70.0
    here, there = system(page.flat, edges, page.lengths), system(moved, np.sort(numbers[edges]), page.lengths)
    np.testing.assert_array_equal(numbers[rim_first(page.flat, edges)[0]], rim_first(moved, edges)[0])
    np.testing.assert_array_equal(here.edges, there.edges)
    together = set(zip(here.prepared.owner, there.prepared.owner, strict=True))
    assert len(together) == here.prepared.owner.max() + 1 == there.prepared.owner.max() + 1


def test_particles_in_one_place_or_in_a_line_give_finite_ways():
    edges = np.array([[0, 1], [1, 2], [2, 3]])
    for flat in (np.zeros((4, 2)), np.outer(np.arange(4.0), [3.0, 4.0])):
        line, way = system(flat, edges, np.ones(3)), np.zeros_like(flat)
        precondition(line.prepared, line.edges, line.gradients, line.force, way)
        assert np.isfinite(way).all()


def test_particles_that_only_rounding_holds_are_not_thrown_off(rng):
    """Nearly in one line, so that a turn, or a way across, has next to no stiffness."""
    x, y = np.meshgrid(np.arange(40.0), np.arange(4.0))
    edges = np.concatenate([np.stack([k, k + 1], axis=1) for k in np.arange(160).reshape(4, 40)[:, :-1]])
    for off in (1e-9, 1e-7, 1e-6):
        flat = np.stack([x.ravel(), off * (y.ravel() + rng.normal(size=160))], axis=1)
        line, way = system(flat, edges, np.full(len(edges), 1.1)), np.zeros_like(flat)
        correct_rigidly(line.prepared, line.force, way)
        assert np.abs(way).max() < 40.0  # the length of the line


@pytest.mark.parametrize("count", [300, 3000])
def test_a_page_of_any_size_is_balanced_in_as_many_passes(warped, count):
    page = warped("curl", count=count)
    bent = page.flat + 2.0 * np.sin(page.flat / 60.0)  # along the whole page
    assert system(bent, Topology(page.mesh.faces).edges, page.lengths).solved_in(PRECISELY) < PASSES


@pytest.mark.parametrize("needle", [1e-2, 1e-3, 1e-4])
def test_slivers_cost_hardly_a_pass(warped, needle):
    """Every tenth face has a vertex of its own at a small part of an edge from its corner."""
    page = warped("curl", count=500)
    split = page.mesh.faces[::10]
    own = len(page.flat) + np.arange(len(split))
    flat = np.vstack([page.flat, np.einsum("fck,c->fk", page.flat[split], [1.0 - needle, 0.6 * needle, 0.4 * needle])])
    edges = np.vstack([Topology(page.mesh.faces).edges, *(np.stack([split[:, k], own], axis=1) for k in range(3))])
    lengths = np.linalg.norm(flat[edges[:, 0]] - flat[edges[:, 1]], axis=1)
    bent = flat + 2.0 * np.sin(flat / 60.0)
    assert system(bent, edges, lengths).solved_in(PRECISELY) < PASSES


def test_compiled_and_plain_python_agree(warped, plain):
    page = warped("fold", count=200)
    tilted = page.flat + np.random.default_rng(0).normal(0, 0.5, page.flat.shape)
    net = system(tilted, Topology(page.mesh.faces).edges, page.lengths)
    compiled, way = np.zeros_like(net.force), np.zeros_like(net.force)
    module = import_module("restore.flattening.isometric.preconditioner")
    work = precondition(net.prepared, net.edges, net.gradients, net.force, compiled)
    assert {"precondition", "substitute", "correct_rigidly", "_factorise", "_invert_pivots"} <= set(plain(module))
    by = module.prepared(net.flat, net.edges.astype(int), net.gradients, net.blocks)
    again = module.precondition(by, net.edges.astype(int), net.gradients, net.force, way)
    assert again == pytest.approx(work, rel=PARITY)
    np.testing.assert_allclose(way, compiled, atol=PARITY * np.abs(compiled).max())
