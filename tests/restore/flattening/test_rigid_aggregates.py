"""Rigid aggregates: what they move is the exact solution among rigid motions of groups of particles."""

from importlib import import_module

import numpy as np
import pytest

from restore.flattening.gauss_newton import _linearised
from restore.flattening.rigid_aggregates import GROWTH, MODES, STIFFEN, aggregate, correct_rigidly
from restore.mesh.network import edges_of

EXACT = 1e-4  # of the largest way: the stiffening of 1e-6 is felt where the page as a whole may move
PARITY = 1e-9
PASSES = 60  # aggregates of 40 particles leave 25 to 40 passes, on a page of any size


@pytest.fixture(params=[60, 500, 2000])
def askew(request, warped):
    """A page of several sizes with its sticks out of balance: flat, edges, gradients, forces."""
    page = warped("gutter", count=request.param)
    flat = page.flat + np.random.default_rng(0).normal(0, 0.05, page.flat.shape)
    edges = edges_of(page.mesh.faces)
    gradients, force, _, _ = _linearised(flat, edges, page.lengths, np.ones(len(edges)), np.inf)
    return flat, edges, gradients, force


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


def test_every_particle_has_an_aggregate_of_neighbours(askew):
    flat, edges, gradients, _ = askew
    owner = aggregate(flat, edges, gradients).owner
    members = np.bincount(owner)
    assert (members > 0).all()
    wanted = len(flat) ** GROWTH
    assert 0.5 * wanted <= len(members) < 2.0 * wanted + 1
    extent = max(np.ptp(flat[owner == k], axis=0).max() for k in range(len(members)))
    area = np.ptp(flat, axis=0).prod()
    assert extent < 2.0 * np.sqrt(area / wanted)


def test_the_way_balances_all_rigid_motions(askew):
    flat, edges, gradients, force = askew
    aggregates, way = aggregate(flat, edges, gradients), np.zeros_like(flat)
    work = correct_rigidly(aggregates, force, way)
    motions = rigid_motions(aggregates)
    strained = strains(edges, gradients, motions)
    stiffness = strained.T @ strained
    stiffness += STIFFEN * np.diag(np.diag(stiffness))
    if len(stiffness) > MODES:  # a page that is one aggregate has no stiffness, and goes nowhere
        exact = motions @ np.linalg.solve(stiffness, motions.T @ force.ravel())
        np.testing.assert_allclose(way.ravel(), exact, atol=EXACT * np.abs(exact).max())
        assert work == pytest.approx((force * way).sum(), rel=EXACT)
        assert work > 0


def test_a_page_that_is_turned_has_the_same_aggregates(askew):
    flat, edges, gradients, _ = askew
    angle = np.deg2rad(140.0)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    here, there = aggregate(flat, edges, gradients).owner, aggregate(flat @ turn + 70.0, edges, gradients @ turn).owner
    together = {(a, b) for a, b in zip(here, there, strict=True)}
    assert len(together) == here.max() + 1 == there.max() + 1


def test_particles_in_one_place_or_in_a_line_give_finite_ways():
    edges = np.array([[0, 1], [1, 2], [2, 3]])
    for flat in (np.zeros((4, 2)), np.outer(np.arange(4.0), [3.0, 4.0])):
        gradients, force, _, _ = _linearised(flat, edges, np.ones(3), np.ones(3), np.inf)
        way = np.zeros_like(flat)
        correct_rigidly(aggregate(flat, edges, gradients), force, way)
        assert np.isfinite(way).all()


def test_particles_that_only_rounding_holds_are_not_thrown_off(rng):
    """Nearly in one line, so that a turn, or a way across, has next to no stiffness."""
    x, y = np.meshgrid(np.arange(40.0), np.arange(4.0))
    edges = np.concatenate([np.stack([k, k + 1], axis=1) for k in np.arange(160).reshape(4, 40)[:, :-1]])
    for off in (1e-9, 1e-7, 1e-6):
        flat = np.stack([x.ravel(), off * (y.ravel() + rng.normal(size=160))], axis=1)
        lengths = np.full(len(edges), 1.1)
        gradients, force, _, _ = _linearised(flat, edges, lengths, np.ones(len(edges)), np.inf)
        way = np.zeros_like(flat)
        correct_rigidly(aggregate(flat, edges, gradients), force, way)
        assert np.abs(way).max() < 40.0  # the length of the line


@pytest.mark.parametrize("count", [300, 3000])
def test_a_page_of_any_size_is_balanced_in_as_many_passes(warped, count):
    page = warped("curl", count=count)
    solver = import_module("restore.flattening.gauss_newton")
    bent = page.flat + 2.0 * np.sin(page.flat / 60.0)  # along the whole page
    edges, lengths = edges_of(page.mesh.faces), page.lengths
    gradients, force, inverse, _ = _linearised(bent, edges, lengths, np.ones(len(edges)), np.inf)
    start = solver._preconditioned(force, inverse, np.empty_like(force))
    step, together = np.zeros_like(force), aggregate(bent, edges, gradients)
    assert solver._conjugate_gradients(step, edges, gradients, force, inverse, together, 1e-6 * start) < PASSES


def test_compiled_and_plain_python_agree(warped, plain):
    page = warped("fold", count=200)
    edges, askew = edges_of(page.mesh.faces), page.flat + np.random.default_rng(0).normal(0, 0.5, page.flat.shape)
    gradients, force, _, _ = _linearised(askew, edges, page.lengths, np.ones(len(edges)), np.inf)
    compiled, way = np.zeros_like(force), np.zeros_like(force)
    module = import_module("restore.flattening.rigid_aggregates")
    work = module.correct_rigidly(module.aggregate(askew, edges, gradients), force, compiled)
    assert {"aggregate", "correct_rigidly"} <= set(plain(module))
    assert module.correct_rigidly(module.aggregate(askew, edges, gradients), force, way) == pytest.approx(
        work, rel=PARITY
    )
    np.testing.assert_allclose(way, compiled, atol=PARITY * np.abs(compiled).max())
