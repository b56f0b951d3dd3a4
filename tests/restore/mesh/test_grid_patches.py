"""Quadratic patches over windows of a grid."""

import numpy as np

from restore.mesh.ordered_grid import RIDGE, fit_patches

REACH = 3
ROWS, COLS = np.arange(0, 20, 4), np.arange(0, 28, 4)
PRIOR_MM = 400 * RIDGE  # what the ridge takes of terms of some hundreds of millimetres


def bowl():
    """Points (20, 28, 3) of a paraboloid: a quadratic patch has no error on it."""
    row, col = np.indices((20, 28)).astype(float)
    x, y = 2.0 * (col - 14), -2.0 * (row - 10)
    return np.dstack([x, y, 0.01 * x**2 + 0.005 * x * y - 0.02 * y**2])


def fitted(points, pieces=None):
    pieces = np.zeros(points.shape[:2], np.int64) if pieces is None else pieces
    return fit_patches(points, pieces, np.bincount(pieces.ravel())[pieces], ROWS, COLS, REACH)


def test_a_paraboloid_and_its_normals_come_back():
    points = bowl()
    positions, normals, own = fitted(points)
    np.testing.assert_allclose(positions, points[np.ix_(ROWS, COLS)], atol=PRIOR_MM)
    x, y, _ = np.moveaxis(points[np.ix_(ROWS, COLS)], 2, 0)
    true = np.dstack([0.02 * x + 0.005 * y, 0.005 * x - 0.04 * y, -np.ones_like(x)])  # rows run down: away from z
    true /= np.linalg.norm(true, axis=2)[..., None]
    np.testing.assert_allclose(normals, true, atol=PRIOR_MM)
    assert (own == 0).all()


def test_noise_is_averaged():
    rng = np.random.default_rng(1)
    points = bowl()
    positions, _, _ = fitted(points + rng.normal(scale=0.5, size=points.shape))
    inner = positions[1:-1, 1:-1] - points[np.ix_(ROWS, COLS)][1:-1, 1:-1]
    assert inner.std() < 0.5 * 0.35  # a quadratic over 49 points leaves 0.27 of the noise in its middle


def test_a_patch_takes_in_no_point_of_another_piece():
    points, pieces = bowl(), np.zeros((20, 28), np.int64)
    pieces[:, 14:] = 1
    points[:, 14:, 2] += 100.0
    positions, _, own = fitted(points, pieces)
    np.testing.assert_allclose(positions, points[np.ix_(ROWS, COLS)], atol=PRIOR_MM)
    np.testing.assert_array_equal(own, np.broadcast_to(COLS >= 14, own.shape))


def test_windows_with_too_few_points_have_no_patch():
    points = bowl()
    points[:, 10:] = np.nan
    positions, normals, own = fitted(points)
    known = own >= 0
    assert known[:, COLS < 10].all()
    assert not known[:, COLS > 12].any()
    assert np.isnan(positions[~known]).all()
    assert np.isnan(normals[~known]).all()
