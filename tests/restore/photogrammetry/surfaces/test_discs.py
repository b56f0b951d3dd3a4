"""Quadratics of discs are exact on quadratics, and are told from discs that hold a crease."""

from __future__ import annotations

import numpy as np

from restore.photogrammetry.surfaces.discs import CLEAN, Discs, fit_discs

RNG = np.random.default_rng(4)
PLACES = RNG.uniform(-20, 20, (600, 2))
RADIUS_MM = 7.0
SIGMA_MM = 0.02
EXACT_MM = 1e-3  # of a bend of third order in a frame that is tilted


def members(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    near = [np.flatnonzero(np.linalg.norm(places - one, axis=1) < RADIUS_MM) for one in places]
    return np.concatenate([[0], np.cumsum([len(one) for one in near])]), np.concatenate(near)


def bowl(places: np.ndarray) -> np.ndarray:
    x, y = places.T
    return np.column_stack([x, y, 0.002 * x * x - 0.001 * x * y + 0.3 * x])


def roof(places: np.ndarray) -> np.ndarray:
    return np.column_stack([places, 0.3 * np.abs(places[:, 0])])


def test_a_quadratic_is_followed_and_predicted():
    points = bowl(PLACES)
    discs = Discs(*fit_discs(points, *members(PLACES)))
    known = np.flatnonzero(np.isfinite(discs.misfits))
    assert discs.misfits[known].max() < EXACT_MM
    others = known[np.argmin(np.linalg.norm(PLACES[known][:, None] - PLACES[known] - [4.0, 0.0], axis=2), axis=1)]
    off = discs.discrepancies(known, points[others], np.zeros(len(known)), SIGMA_MM)
    assert off.max() < 10 * EXACT_MM / SIGMA_MM
    raised = discs.discrepancies(known, points[others] + [0, 0, 1.0], np.zeros(len(known)), SIGMA_MM)
    assert raised.min() > 3


def test_a_disc_over_a_crease_predicts_nothing():
    discs = Discs(*fit_discs(roof(PLACES), *members(PLACES)))
    over = np.flatnonzero((np.abs(PLACES[:, 0]) < 1) & np.isfinite(discs.misfits))
    assert (discs.misfits[over] > CLEAN * SIGMA_MM).all()
    assert np.isinf(discs.discrepancies(over, roof(PLACES[over]), np.zeros(len(over)), SIGMA_MM)).all()


def test_the_best_disc_next_to_a_crease_ends_before_it():
    starts, near = members(PLACES)
    discs = Discs(*fit_discs(roof(PLACES), starts, near))
    best = discs.best(starts, near)
    adjacent = np.flatnonzero((np.abs(np.abs(PLACES[:, 0]) - 3) < 2) & (np.abs(PLACES[:, 1]) < 10))
    assert (np.sign(PLACES[best[adjacent], 0]) == np.sign(PLACES[adjacent, 0])).mean() > 0.95
    assert np.median(discs.misfits[best[adjacent]]) < EXACT_MM


def test_too_few_points_have_no_quadratic():
    discs = Discs(*fit_discs(bowl(PLACES[:8]), np.array([0, 8]), np.arange(8)))
    assert np.isinf(discs.misfits).all()
