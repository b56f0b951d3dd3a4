"""Facets are told apart by their creases, and go on to them."""

from __future__ import annotations

import numpy as np

from restore.photogrammetry.surfaces.facets import find_facets, prolonged
from restore.photogrammetry.surfaces.lattice import Lattice

STEP_MM = 1.5
SHAPE = (40, 60)
LOW = np.array([0.0, 0.0])
CREASE_MM = 44.0  # x of it
CLEAR_MM = 3.0  # from it, where no patch is found
SLOPE = 0.5
NOISE_MM = 0.02
STAGES = ((1.0, 6), (0.0, 6))


def lattice() -> Lattice:
    x, y = STEP_MM * np.arange(SHAPE[1]), STEP_MM * np.arange(SHAPE[0])
    places = np.stack(np.meshgrid(x, y), axis=-1)
    points = np.concatenate([places, np.zeros((*SHAPE, 1))], axis=2)
    return Lattice(LOW, STEP_MM, points, np.broadcast_to([0.0, 0.0, 1.0], points.shape))


def roof(places: np.ndarray) -> np.ndarray:
    return -SLOPE * np.abs(places[..., 0] - CREASE_MM)


def tracked(form: Lattice, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Feet (n, 2) and heights (n,) of points that keep clear of the crease and of a margin."""
    rng = np.random.default_rng(seed)
    feet = rng.uniform(8.0, form.places[-1, -1] - 8.0, (1800, 2))
    feet = feet[np.abs(feet[:, 0] - CREASE_MM) > CLEAR_MM]
    return feet, roof(feet) + NOISE_MM * rng.standard_normal(len(feet))


def test_facets_go_on_to_the_crease_between_them():
    form = lattice()
    feet, above = tracked(form)
    before = form.fitted(feet, above, STAGES)
    after = prolonged(form, before, feet, above, np.ones(len(feet), bool), np.full(len(feet), NOISE_MM))
    near = np.abs(form.places[..., 0] - CREASE_MM) < CLEAR_MM
    assert np.abs(before - roof(form.places)).max() > 0.6  # the relief cuts the crease off
    assert np.median(np.abs(after - roof(form.places))[near]) < NOISE_MM
    # A node that has a point beside it, but the crease in between, stays; a margin goes on as steep as the points.
    assert np.abs(after - roof(form.places)).max() < 0.3


def test_points_of_a_line_do_not_show_facets():
    form = lattice()
    feet, above = tracked(form)
    rim = np.column_stack([np.linspace(50, 80, 40), np.full(40, 2.0)])
    both = np.concatenate([feet, rim]), np.concatenate([above, roof(rim) + 3.0])
    of_facets = np.arange(len(both[0])) < len(feet)
    before = form.fitted(feet, above, STAGES)
    after = prolonged(form, before, *both, of_facets, np.full(len(of_facets), NOISE_MM))
    assert np.abs(after - roof(form.places))[form.places[..., 1] > 8.0].max() < 0.3


def test_a_facet_does_not_go_on_to_an_edge_that_it_misses():
    """A margin of 12 mm without a point, turned up by a crease at its beginning; but the edge of the page is known."""
    form = lattice()
    crease = form.places[-1, -1, 1] - 12.0

    def bent(places):
        return roof(places) + 0.4 * np.maximum(places[..., 1] - crease, 0.0)

    feet, _ = tracked(form)
    feet = feet[feet[:, 1] < crease - CLEAR_MM]
    rim = np.column_stack([np.linspace(0.0, form.places[-1, -1, 0], 60), np.full(60, form.places[-1, -1, 1])])
    both, of_facets = np.concatenate([feet, rim]), np.arange(len(feet) + len(rim)) < len(feet)
    noise = np.full(len(both), NOISE_MM)
    before = form.fitted(both, bent(both), STAGES, noise=noise)
    after = prolonged(form, before, both, bent(both), of_facets, noise)
    margin = form.places[..., 1] > crease + 2.0
    assert np.abs(after - bent(form.places))[margin].max() < 1.0  # of 4.8: the crease is put where points end


def test_two_facets_are_found_and_a_bend_of_paper_is_not_a_facet():
    form = lattice()
    measured = np.ones(SHAPE, bool)
    labels, normals = find_facets(form, roof(form.places), measured)
    left, right = labels[:, : int(CREASE_MM / STEP_MM) - 1], labels[:, int(CREASE_MM / STEP_MM) + 2 :]
    assert left.min() == left.max() != right.min() == right.max()
    np.testing.assert_allclose(np.abs(normals[..., 0]).max(), np.sin(np.arctan(SLOPE)), atol=1e-6)
    curl = 100.0 - np.sqrt(100.0**2 - (form.places[..., 0] - CREASE_MM) ** 2)
    assert set(np.unique(find_facets(form, curl, measured)[0])) == {0}


def test_scraps_are_not_facets():
    form = lattice()
    measured = np.zeros(SHAPE, bool)
    measured[5:9, 5:9] = True
    assert (find_facets(form, roof(form.places), measured)[0] == -1).all()
