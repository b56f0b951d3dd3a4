"""Settling finds the lengths again, and has an answer for points that lie on each other."""

from importlib import import_module

import numpy as np

from restore.flattening.settle import settle
from restore.mesh.measures import edge_strain
from restore.mesh.network import edges_of

SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
EDGES = edges_of(np.array([[0, 1, 2], [0, 2, 3]]))
LENGTHS = np.linalg.norm(SQUARE[EDGES[:, 0]] - SQUARE[EDGES[:, 1]], axis=1)
CONVERGED = 1e-4  # strain: a thousandth of the tenth that the square is pushed askew
PARITY = 1e-9
LEAST_MM = 1e-3  # the third of Newton's steps moves no node farther


def test_a_square_pushed_askew_gets_its_lengths_back():
    askew = SQUARE + np.random.default_rng(0).normal(0, 0.5, SQUARE.shape)
    strain = edge_strain(settle(askew, EDGES, LENGTHS), EDGES, LENGTHS)
    assert np.abs(strain).max() < CONVERGED


def test_joined_points_at_one_place_give_finite_positions():
    collapsed = SQUARE.copy()
    collapsed[1] = collapsed[0]
    assert np.isfinite(settle(collapsed, EDGES, LENGTHS)).all()


def test_no_page_near_by_has_less_strain(warped):
    page = warped("gutter", count=300)
    edges, rng = edges_of(page.mesh.faces), np.random.default_rng(1)
    lengths = page.lengths * rng.uniform(0.97, 1.03, len(page.lengths))  # they contradict each other

    def strain(flat):
        return (edge_strain(flat, edges, lengths) ** 2).sum()

    found = settle(page.flat, edges, lengths)
    ways = rng.normal(0, LEAST_MM, (20, *found.shape))
    assert all(strain(found + way) > strain(found) for way in ways)


def test_points_that_no_stick_holds_stay():
    loose = np.vstack([SQUARE, [[30.0, 40.0]]])
    np.testing.assert_array_equal(settle(loose, EDGES, 1.01 * LENGTHS)[-1], loose[-1])


def test_compiled_and_plain_python_agree(warped, plain):
    page = warped("fold", count=60)
    edges, askew = edges_of(page.mesh.faces), page.flat + np.random.default_rng(0).normal(0, 1.0, page.flat.shape)
    compiled = settle(askew, edges, page.lengths)
    assert "descend" in plain(import_module("restore.flattening.settle"))
    np.testing.assert_allclose(compiled, settle(askew, edges, page.lengths), atol=PARITY)
