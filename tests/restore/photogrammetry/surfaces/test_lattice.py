"""Heights through points: exact on planes, flat up to a crease on folded sheets."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from restore.photogrammetry.surfaces.lattice import Lattice, node_normals

LOW = np.array([-40.0, -30.0])
STEP_MM = 1.6
SHAPE = (38, 51)
CREASE = np.radians(20.0)  # that each facet is turned by
STAGES = ((1.0, 6), (0.5, 5), (0.0, 6))
NOISE_MM = 0.03


def lattice() -> Lattice:
    x, y = LOW[0] + STEP_MM * np.arange(SHAPE[1]), LOW[1] + STEP_MM * np.arange(SHAPE[0])
    places = np.stack(np.meshgrid(x, y), axis=-1)
    points = np.concatenate([places, np.zeros((*SHAPE, 1))], axis=2)
    return Lattice(LOW, STEP_MM, points, np.broadcast_to([0.0, 0.0, 1.0], points.shape))


def drawn(seed: int, count: int = 700) -> np.ndarray:
    return np.random.default_rng(seed).uniform(LOW + 1, -LOW - 1, (count, 2))


def roof(places: np.ndarray) -> np.ndarray:
    """(…) mm: two facets that meet in a line across the lattice."""
    return -np.tan(CREASE) * np.abs(places @ np.array([np.cos(0.4), np.sin(0.4)]))


@given(st.tuples(*[st.floats(-0.5, 0.5)] * 3), st.integers(0, 1000))
@settings(max_examples=10)
def test_a_plane_is_met_exactly(plane, seed):
    places, form = drawn(seed), lattice()
    heights = form.fitted(places, places @ plane[:2] + plane[2], STAGES)
    np.testing.assert_allclose(heights, form.places @ plane[:2] + plane[2], atol=1e-3)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_sheet_is_flat_up_to_its_crease(seed):
    form, rng = lattice(), np.random.default_rng(seed)
    places = drawn(seed, 1200)
    heights = form.fitted(places, roof(places) + NOISE_MM * rng.standard_normal(len(places)), STAGES)
    off = np.abs(heights - roof(form.places))[2:-2, 2:-2]
    assert np.sqrt((off**2).mean()) < NOISE_MM
    assert np.median(off) < NOISE_MM / 4  # facets are wider than the distances of the points
    assert off.max() < 1.2 * STEP_MM * np.tan(CREASE)  # the crease runs between the nodes
    turns = np.linalg.norm(np.diff(node_normals(form.raised(heights)), axis=1), axis=2)
    assert np.mean(turns > np.radians(3.0)) < 0.08  # in three columns of fifty


def test_points_that_are_wrong_are_not_followed():
    form, rng = lattice(), np.random.default_rng(3)
    places = drawn(3, 1200)
    above = roof(places) + NOISE_MM * rng.standard_normal(len(places))
    wrong = rng.random(len(places)) < 0.08
    heights = form.fitted(places, above + wrong * rng.uniform(0.5, 2.0, len(places)), STAGES)
    off = np.abs(heights - roof(form.places))[2:-2, 2:-2]
    assert np.median(off) < NOISE_MM / 4
    assert np.quantile(off, 0.9) < 2 * NOISE_MM  # a wrong point without others beside it is followed


def test_exact_points_count_for_more_than_rough_ones():
    form, places = lattice(), drawn(4, 2000)
    rough = np.arange(len(places)) % 2 == 0
    noise = np.where(rough, 0.4, 0.02)
    above = roof(places) + 0.3 * rough
    heights = form.fitted(places, above, STAGES, noise=noise)
    assert np.median(np.abs(heights - roof(form.places))) < 0.01


@pytest.mark.parametrize("flip", [0, 1])
def test_mirrored_points_give_the_mirrored_relief(flip):
    form, places = lattice(), drawn(5)
    mirrored = places.copy()
    middle = (form.places[0, 0] + form.places[-1, -1]) / 2
    mirrored[:, flip] = 2 * middle[flip] - mirrored[:, flip]
    one, other = (form.fitted(at, roof(places), STAGES) for at in (places, mirrored))
    np.testing.assert_allclose(np.flip(other, axis=1 - flip), one, atol=1e-6)


def test_a_part_has_the_nodes_between_its_corners():
    form = lattice()
    low, high = np.array([-12.0, -9.0]), np.array([15.0, 33.0])
    part, at = form.part(low, high)
    np.testing.assert_allclose(part.places, form.places[at], atol=1e-9)
    within = ((form.places >= low) & (form.places <= high)).all(axis=2)
    assert part.places.shape[0] * part.places.shape[1] == within.sum()
