"""The surface of a creased page against exact sheets, from points that end before the creases."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import Delaunay

from drivers.simulated import Cone, Curl, Miura, MultiFold, Opening, Spread, Wave
from oracles.printed_points import HALF, PAGE_MM, lost, rounded, sampled, true_places
from restore.photogrammetry.cameras.align import Similarity
from restore.photogrammetry.errors import SheetLost
from restore.photogrammetry.mesh import stretch
from restore.photogrammetry.reconstruct import MAX_OFF_MM, MAX_STRETCH
from restore.photogrammetry.surfaces.folded import GUTTER_MM, FoldedSurface, fold, refold
from restore.photogrammetry.surfaces.page_surface import PageSurface
from restore.photogrammetry.surfaces.surface import grid_places

KEPT = 0.002  # of the area: a third of what is reported
LOST_MM = 0.25  # of the length over a crease, that is prolonged to over 2.4 mm from both sides
SPREAD = Spread(slope_deg=58.0, reach_mm=30.0)
FOLDS = MultiFold()
GUTTER = Opening(left_deg=40.0, right_deg=25.0, left_reach_mm=15.0, right_reach_mm=30.0)
SLANT = 0.02  # radians
BLANK_MM = 9.0  # next to a spine, as printed books have
MOVE = Similarity(2.0, np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.array([1.0, 2.0, 3.0]))


def folded(sheet) -> PageSurface:
    points, _ = sampled(sheet)
    smooth, feet = rounded(sheet, points)
    surface = fold(points, feet, smooth)
    assert isinstance(surface, FoldedSurface)
    return refold(points, surface.feet(points, feet), surface)


@pytest.fixture(scope="module")
def spread() -> PageSurface:
    return folded(SPREAD)


@pytest.fixture(scope="module")
def folds() -> PageSurface:
    return folded(FOLDS)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "sheet"), [("spread", SPREAD), ("folds", FOLDS)])
def test_no_length_is_lost_over_creases(name, sheet, request):
    surface = request.getfixturevalue(name)
    assert abs(lost(surface, sheet)) < LOST_MM
    assert lost(surface.smooth, sheet) > 3 * LOST_MM  # which rounds them


def test_each_piece_follows_its_side_to_the_crease(spread):
    places = grid_places(-HALF + 20, HALF - 20, 2.0)
    points = spread.points(places)
    off = np.linalg.norm(points - SPREAD.warp(true_places(SPREAD, points), PAGE_MM), axis=1)
    assert np.quantile(off, 0.99) < LOST_MM


def test_squares_over_a_crease_are_reported(spread):
    places = spread.smooth.nearest(
        SPREAD.warp(np.array([[-20.0, 0.0], [-2.0, 10.0], [2.0, 10.0], [30.0, 5.0]]), PAGE_MM)
    )
    assert spread.uncreased(places, 4.0).tolist() == [True, False, False, True]
    assert spread.uncreased(places, 0.5).all()


@pytest.mark.parametrize("name", ["spread", "folds"])
def test_a_folded_page_has_the_area_of_its_pieces_and_a_torn_one_more(name, request):
    surface = request.getfixturevalue(name)
    places = grid_places(-HALF + 15, HALF - 15, 2.0)
    faces = Delaunay(places).simplices.astype(np.int64)
    vertices = surface.creased(places, faces)
    assert stretch(vertices, faces, surface.flat_corners(vertices, faces, places)) == pytest.approx(0.0, abs=KEPT)
    torn = vertices + np.where(places[:, :1] > 30.0, [4.0, 0.0, 0.0], 0.0)
    assert stretch(torn, faces, surface.flat_corners(vertices, faces, places)) > MAX_STRETCH


@pytest.mark.parametrize("sheet", [Wave(slope_deg=30.0, wavelength_mm=120.0), Miura(side_mm=40.0, width_mm=40.0)])
def test_a_page_without_creases_or_with_many_is_left_smooth(sheet):
    points, _ = sampled(sheet)
    smooth, feet = rounded(sheet, points)
    assert fold(points, feet, smooth) is smooth


@pytest.mark.parametrize("sheet", [Curl(radius_mm=110.0, taper=0.3), Cone(apex_mm=280.0, opening_deg=45.0)])
def test_a_blank_strip_of_a_smooth_page_is_not_a_crease(sheet):
    points, flat = sampled(sheet)
    points = points[np.abs(flat[:, 0]) > BLANK_MM]
    smooth, feet = rounded(sheet, points)
    assert fold(points, feet, smooth) is smooth


def test_noise_is_not_a_crease():
    wave = Wave(slope_deg=38.0, wavelength_mm=90.0)
    points, _ = sampled(wave, noise=0.15)
    smooth, feet = rounded(wave, points)
    assert fold(points, feet, smooth) is smooth


def test_a_gutter_without_print_is_a_crease():
    points, flat = sampled(GUTTER)
    points = points[np.abs(flat[:, 0]) > BLANK_MM]
    smooth, feet = rounded(GUTTER, points)
    surface = fold(points, feet, smooth)
    assert isinstance(surface, FoldedSurface)
    assert abs(lost(surface, GUTTER)) < lost(smooth, GUTTER) / 3


def test_folds_move_with_the_model(folds):
    places = grid_places(-HALF + 20, HALF - 20, 9.0)
    moved = folds.moved(MOVE)
    np.testing.assert_allclose(moved.points(places), MOVE.points(folds.points(places)), atol=1e-6)
    np.testing.assert_allclose(moved.normals(places), folds.normals(places) @ MOVE.rotation.T, atol=1e-6)


def test_frames_are_those_of_the_piece_at_a_place(folds):
    places = grid_places(-HALF + 20, HALF - 20, 9.0)
    points, tangents, normals, _ = folds.frames(places)
    np.testing.assert_allclose(points, folds.points(places), atol=1e-9)
    np.testing.assert_allclose(normals, folds.normals(places), atol=1e-9)
    np.testing.assert_allclose(np.einsum("nki,ni->nk", tangents, normals), 0.0, atol=1e-9)


def test_a_piece_through_which_no_sheet_goes_leaves_the_page_smooth(monkeypatch):
    points, _ = sampled(FOLDS)
    smooth, feet = rounded(FOLDS, points)

    def lost(*_args, **_how):
        raise SheetLost("slid off")

    monkeypatch.setattr("restore.photogrammetry.surfaces.folded.fit_paper", lost)
    assert fold(points, feet, smooth) is smooth


def test_a_gutter_is_as_wide_in_each_row(spread):
    assert np.ptp(spread.gutter_widths()) < MAX_OFF_MM


def test_a_leaf_that_slants_along_the_spine_makes_it_uneven(spread):
    cosine, sine = np.cos(SLANT), np.sin(SLANT)
    turned = Similarity(1.0, np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]]), np.zeros(3))
    first, second = spread.pieces
    widths = replace(spread, pieces=(first, second.moved(turned))).gutter_widths()
    # A leaf raised by h meets the other farther on, which changes no length; its row ends at its slope, h · sin before.
    end = np.radians(SPREAD.slope_deg) * np.exp(-GUTTER_MM / SPREAD.reach_mm)
    rows = np.ptp(spread.places[:, 1])
    # The rows end on places of a surface that rounds the spine: a third of a slope off.
    assert np.ptp(widths) == pytest.approx(SLANT * rows * np.sin(end), rel=0.3)
