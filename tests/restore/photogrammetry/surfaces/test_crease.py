"""The line along which a surface turns most is the crease of a page that has one."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.simulated import MultiFold, Opening
from oracles.printed_points import rounded, sampled
from restore.photogrammetry.surfaces.crease import LATTICE_MM, Crease, find_crease
from restore.photogrammetry.surfaces.folded import MIN_FRACTION
from restore.photogrammetry.surfaces.surface import Surface, grid_places

OFFSET = -17
OPENING = Opening(40.0, 25.0, 15.0, 30.0, OFFSET)
BLANK_MM = 9.0


@pytest.mark.parametrize("blank_mm", [0.0, BLANK_MM])
def test_the_spine_of_a_book_is_found(blank_mm):
    points, flat = sampled(OPENING)
    points = points[np.abs(flat[:, 0] - OFFSET) >= blank_mm]
    smooth, feet = rounded(OPENING, points)
    crease = find_crease(feet, smooth, MIN_FRACTION)
    assert np.degrees(np.arctan(crease.across[1] / crease.across[0])) == pytest.approx(0.0, abs=1.0)
    assert crease.offset * crease.across[0] == pytest.approx(OFFSET, abs=2 * LATTICE_MM)


@pytest.mark.parametrize("slant_deg", [0.0, 8.0, -20.0, 75.0])
def test_a_slanted_crease_is_found(slant_deg):
    sheet = MultiFold(creases=((5.0, slant_deg, 40.0),))
    points, _ = sampled(sheet)
    smooth, feet = rounded(sheet, points)
    crease = find_crease(feet, smooth, MIN_FRACTION)
    sides = crease.beyond(feet) > 0
    normals = smooth.normals(feet)[np.abs(crease.beyond(feet)) > smooth.step]
    beyond = sides[np.abs(crease.beyond(feet)) > smooth.step]
    for side in (beyond, ~beyond):  # all of one panel
        assert np.degrees(np.arccos(np.clip(normals[side] @ np.median(normals[side], axis=0), -1, 1))).max() < 10.0


def test_a_flat_page_has_a_line_with_points_on_both_sides():
    places = grid_places(np.array([-60.0, -40.0]), np.array([60.0, 40.0]), 5.0)
    crease = find_crease(places, Surface.level(np.array([-70.0, -50.0]), np.array([70.0, 50.0]), 1.0), MIN_FRACTION)
    beyond = crease.beyond(places) > 0
    assert 0 < beyond.sum() < len(places)


def test_places_are_turned_so_that_the_line_is_upright():
    crease = Crease(np.array([0.6, 0.8]), 7.0)
    on_line = 7.0 * crease.across + np.array([[-30.0], [50.0]]) * crease.turn[1]
    np.testing.assert_allclose(on_line @ crease.turn.T, [[7.0, -30.0], [7.0, 50.0]], atol=1e-12)
    np.testing.assert_allclose(crease.beyond(on_line), 0.0, atol=1e-12)
    assert np.linalg.det(crease.turn) == pytest.approx(1.0)
