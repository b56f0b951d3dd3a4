"""Points on exact sheets are told apart by the creases between them, and by nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.simulated import Cone, Curl, Miura, MultiFold, Spread, Wave
from oracles.printed_points import normals, sampled
from restore.photogrammetry.surfaces.pieces import CORE, find_pieces

LOST = 0.03  # of the points may be on no piece, as outliers
FACETS = (MultiFold(), Miura(), Miura(side_mm=42.0, width_mm=48.0, fold_deg=20.0))
SMOOTH = (
    Wave(slope_deg=38.0, wavelength_mm=90.0),
    Curl(radius_mm=110.0, taper=0.3),
    Cone(apex_mm=280.0, opening_deg=45.0),
)


@pytest.mark.parametrize("sheet", FACETS, ids=lambda sheet: sheet.name)
def test_each_facet_is_a_piece(sheet):
    points, places = sampled(sheet)
    labels, normal = find_pieces(points, places), normals(sheet, places)
    assert (labels < 0).mean() < LOST
    for piece in range(labels.max() + 1):
        own = normal[labels == piece]
        assert len(own) >= CORE
        assert np.abs(own - own[0]).max() < 1e-6  # of one facet
    if sheet.name == "multifold":
        assert labels.max() + 1 == len(sheet.creases) + 1


def test_the_pages_of_a_spread_are_distinguished():
    points, places = sampled(Spread(slope_deg=58.0, reach_mm=30.0))
    labels = find_pieces(points, places)
    assert labels.max() == 1
    for piece in range(2):
        assert len(set(np.sign(places[labels == piece, 0]))) == 1


def test_a_page_that_bends_ever_more_is_one_piece_up_to_the_spine():
    points, places = sampled(Spread(slope_deg=58.0, reach_mm=30.0), spacing=4.5, noise=0.01)
    labels = find_pieces(points, places)
    assert labels.max() == 1
    assert (labels[np.abs(places[:, 0]) < 30] < 0).mean() < LOST


@pytest.mark.parametrize("spacing", [2.5, 4.0])
@pytest.mark.parametrize("sheet", SMOOTH, ids=lambda sheet: sheet.name)
def test_no_crease_is_found_on_smooth_sheets(sheet, spacing):
    assert find_pieces(*sampled(sheet, spacing)).max() == 0


def test_noise_is_not_a_crease():
    assert find_pieces(*sampled(SMOOTH[0], noise=0.15)).max() == 0


def test_a_blank_area_parts_no_page():
    points, places = sampled(SMOOTH[1])
    blank = (np.abs(places[:, 0] - 10) < 30) | (np.abs(places[:, 1]) > 60)
    blank[:40] = False  # a line of print beyond it
    assert find_pieces(points[~blank], places[~blank]).max() == 0


def test_points_far_off_are_on_no_piece():
    points, places = sampled(SMOOTH[1])
    points[::50, 2] += 3.0
    labels = find_pieces(points, places)
    assert labels.max() == 0
    assert (labels[::50] < 0).all()
