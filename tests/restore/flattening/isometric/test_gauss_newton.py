"""Gauss–Newton finds the lengths again, says whether it converged, and survives coincident vertices."""

from importlib import import_module

import numpy as np
import pytest

from restore import flatten
from restore.flattening.isometric.angle_synchronisation import SHORTEST
from restore.flattening.isometric.gauss_newton import (
    GRADIENT_TOLERANCE,
    edge_areas,
    least_absolute_strain,
    minimise_strain,
)
from restore.mesh.measures import edge_strain
from restore.mesh.network import make_network
from restore.mesh.topology import Topology
from restore.scan import SurfaceMesh

SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])
NETWORK = make_network(SQUARE, Topology(FACES))
CONVERGED = 1e-4  # strain: a thousandth of the tenth that the square is pushed askew
PARITY = 1e-9
MIN_MM = 1e-3  # the third iteration moves no node farther
EXACT = 1e-12
FEW = 0.01  # of the lengths
SAME_MM = 1e-3  # with weights that may change the iteration stops earlier


def network_of(page, lengths=None):
    return make_network(page.mesh.vertices, Topology(page.mesh.faces), page.lengths if lengths is None else lengths)


def test_a_sheared_square_gets_its_lengths_back():
    tilted = SQUARE + np.random.default_rng(0).normal(0, 0.5, SQUARE.shape)
    strain = edge_strain(minimise_strain(tilted, NETWORK).flat, NETWORK.edges, NETWORK.lengths)
    assert np.abs(strain).max() < CONVERGED


def test_coincident_vertices_give_finite_positions():
    collapsed = SQUARE.copy()
    collapsed[1] = collapsed[0]
    assert np.isfinite(minimise_strain(collapsed, NETWORK).flat).all()


def test_what_stands_still_far_from_its_lengths_has_not_converged():
    """A ribbon that the fall of its sticks leaves in a tangle."""
    across, along = (part.ravel() for part in np.meshgrid([0.0, 1.0], np.arange(501.0)))
    vertices = np.stack([200.0 * np.sin(along / 200.0), across, 200.0 * np.cos(along / 200.0)], axis=1)
    corners = 2 * np.arange(500)[:, None]
    page = flatten(SurfaceMesh(vertices, np.vstack([corners + [0, 2, 1], corners + [1, 2, 3]])), "sticks")
    assert page.residual > 1.0
    assert not page.converged


def test_a_start_that_is_nowhere_is_given_up_at_once():
    found = minimise_strain(np.full_like(SQUARE, np.nan), NETWORK)
    assert found.iterations == 0
    assert not found.converged


def test_no_page_near_by_has_less_strain(warped):
    page = warped("gutter", count=300)
    rng = np.random.default_rng(1)
    network = network_of(page, page.lengths * rng.uniform(0.97, 1.03, len(page.lengths)))  # they contradict each other
    areas = edge_areas(network)

    def energy(flat):
        return (areas * edge_strain(flat, network.edges, network.lengths) ** 2).sum()

    found = minimise_strain(page.flat, network).flat
    ways = rng.normal(0, MIN_MM, (20, *found.shape))
    assert all(energy(found + way) > energy(found) for way in ways)


def test_a_few_wrong_lengths_hardly_move_the_page_of_least_absolute_strain(warped):
    page = warped("gutter", count=300)
    rng = np.random.default_rng(2)
    wrong = rng.random(len(page.lengths)) < FEW
    network = network_of(page, np.where(wrong, 1.5, 1.0) * page.lengths)
    squares = minimise_strain(page.flat, network)
    found = least_absolute_strain(squares, network)
    assert found.iterations > squares.iterations
    misplaced = [np.median(np.linalg.norm(solution.flat - page.flat, axis=1)) for solution in (found, squares)]
    assert misplaced[0] < 0.5 * misplaced[1]


def test_a_corner_far_from_the_sheet_is_not_found(warped):
    page = warped("gutter", count=300)
    network = network_of(page, page.lengths * np.random.default_rng(3).uniform(0.97, 1.03, len(page.lengths)))
    squares, far = (minimise_strain(page.flat, network, corner=corner).flat for corner in (np.inf, 1e6))
    np.testing.assert_allclose(far, squares, atol=SAME_MM)


def test_between_two_lengths_of_its_edges_a_page_may_be_as_it_likes(warped):
    page = warped("gutter", count=300)
    shorter, longer = network_of(page, 0.9 * page.lengths), 1.1 * page.lengths
    found = minimise_strain(page.flat, shorter, corner=1e-3, other=longer).flat
    on_page = np.linalg.norm(np.diff(found[shorter.edges], axis=1)[:, 0], axis=1)
    assert (on_page > shorter.lengths).all()
    assert (on_page < longer).all()


def test_rest_areas_are_those_of_the_faces():
    np.testing.assert_allclose(NETWORK.areas, [50.0, 50.0])


def test_the_residual_and_convergence_are_reported(warped):
    page = warped("gutter", count=300)
    bent = page.flat + 2.0 * np.sin(page.flat / 60.0)
    stopped, done = (minimise_strain(bent, network_of(page), most) for most in (1, 50))
    assert not stopped.converged
    assert stopped.iterations == 1
    assert done.converged
    assert done.residual <= GRADIENT_TOLERANCE / np.sqrt(len(bent)) < stopped.residual
    again = minimise_strain(done.flat, network_of(page))
    assert again.iterations == 0


def test_vertices_without_an_edge_stay():
    loose = np.vstack([SQUARE, [[30.0, 40.0]]])
    stretched = make_network(SQUARE, Topology(FACES), 1.01 * NETWORK.lengths)
    np.testing.assert_array_equal(minimise_strain(loose, stretched).flat[-1], loose[-1])


def test_edges_weigh_as_the_areas_of_their_faces():
    vertices = np.array([[0, 0, 0], [4, 0, 0], [0, 3, 0], [0, -30, 0], [4.0, 0, 0]], float)
    network = make_network(vertices, Topology(np.array([[0, 1, 2], [0, 3, 1], [1, 2, 4]])))
    areas = dict(zip(map(tuple, network.edges), edge_areas(network), strict=True))
    assert areas[0, 1] / areas[0, 2] == pytest.approx(66 / 6, rel=EXACT)
    assert areas[2, 4] == SHORTEST  # of a face without area
    assert np.mean([areas[edge] for edge in areas]) == pytest.approx(1.0, rel=SHORTEST)


def test_compiled_and_plain_python_agree(warped, plain):
    page = warped("fold", count=60)
    tilted = page.flat + np.random.default_rng(0).normal(0, 1.0, page.flat.shape)
    compiled = minimise_strain(tilted, network_of(page)).flat
    assert {"_go_on", "_linearise"} <= set(plain(import_module("restore.flattening.isometric.gauss_newton")))
    np.testing.assert_allclose(minimise_strain(tilted, network_of(page)).flat, compiled, atol=PARITY)


def with_sliver(page, edge, shares, off_mm, seed):
    """A page with one more vertex, off_mm beside an edge of its border, and all its lengths wrong by up to a hundredth.

    Those of the new edges are shares of the edge's. The flat positions and the network.
    """
    one, other = edge
    across = page.flat[other] - page.flat[one]
    adjacent = page.flat[one] + 0.4 * across + off_mm * np.array([-across[1], across[0]])
    flat = np.vstack([page.flat, adjacent])
    faces = np.vstack([page.mesh.faces, [[one, other, len(page.flat)]]])
    network = make_network(flat, Topology(faces))
    lengths = network.lengths * np.random.default_rng(seed).uniform(0.99, 1.01, len(network.lengths))
    lengths[(network.edges == len(page.flat)).any(axis=1)] = np.linalg.norm(across) * np.array(shares)
    return flat, make_network(flat, Topology(faces), lengths)


@pytest.mark.parametrize("shares", [(0.5, 0.4), (0.5, 0.45), (0.6, 0.37), (0.7, 0.7 - 1e-9)])
@pytest.mark.parametrize("off_mm", [1e-3, 1e-5, 0.0])
def test_a_vertex_that_only_a_sliver_holds_is_not_thrown_off(warped, shares, off_mm):
    """Its two edges are shorter together than the one across, or hardly longer, and it lies beside that or on it."""
    page = warped("gutter", count=300)
    border, inside = Topology(page.mesh.faces).border, make_network(page.flat, Topology(page.mesh.faces))
    on_border = [edge for edge in inside.edges if np.isin(edge, border).all()]
    for seed, edge in enumerate(on_border[::4]):
        flat, network = with_sliver(page, edge, shares, off_mm, seed)
        found = least_absolute_strain(minimise_strain(flat, network), network).flat
        apart = np.linalg.norm(found[-1] - found[edge], axis=1) / np.linalg.norm(np.diff(page.flat[edge], axis=0))
        assert (apart < 2.0 * np.array(shares)).any()  # of its edges one at least is not strained by more than 1
