"""Settling finds the lengths again, and has an answer for points that lie on each other."""

import numpy as np

from restore.flatten.network import edges_of
from restore.flatten.settle import settle
from restore.strain import edge_strain

SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
EDGES = edges_of(np.array([[0, 1, 2], [0, 2, 3]]))
LENGTHS = np.linalg.norm(SQUARE[EDGES[:, 0]] - SQUARE[EDGES[:, 1]], axis=1)
CONVERGED = 1e-9  # relative; Newton's steps double the correct digits


def test_a_square_pushed_askew_gets_its_lengths_back():
    askew = SQUARE + np.random.default_rng(0).normal(0, 0.5, SQUARE.shape)
    strain = edge_strain(settle(askew, EDGES, LENGTHS, 8), EDGES, LENGTHS)
    assert np.abs(strain).max() < CONVERGED


def test_joined_points_at_one_place_give_finite_positions():
    collapsed = SQUARE.copy()
    collapsed[1] = collapsed[0]
    assert np.isfinite(settle(collapsed, EDGES, LENGTHS)).all()
