"""The surface of a creased page against exact sheets, from points that end before the creases."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.simulated import Miura, MultiFold, Spread, Wave
from oracles.printed_points import HALF, PAGE_MM, rounded, sampled
from restore.mesh.ordered_grid import grid_faces
from restore.photogrammetry.align import Similarity
from restore.photogrammetry.errors import SheetLost
from restore.photogrammetry.folded import FoldedSurface, fold, refold
from restore.photogrammetry.page_surface import PageSurface
from restore.photogrammetry.surface import grid_places

STEP_MM = 2.0  # of the mesh
LOST_MM = 0.25  # of the length over a crease, that is prolonged to over 2.4 mm from both sides
SPREAD = Spread(slope_deg=58.0, reach_mm=30.0)
FOLDS = MultiFold()
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


def mesh(surface: PageSurface) -> np.ndarray:
    """(rows, cols, 3) vertices over the print, some of them on the creases."""
    x, y = (np.arange(-half + 15, half - 15, STEP_MM) for half in HALF)
    places = np.stack(np.meshgrid(x, y[::-1]), axis=-1)
    faces = grid_faces(np.ones(places.shape[:2], bool))
    return surface.creased(places.reshape(-1, 2), faces).reshape(*places.shape[:2], 3)


def lost(surface: PageSurface, sheet) -> float:
    """Median over the rows of the true length, mm, from end to end less that along the mesh."""
    rows = mesh(surface)
    along = np.linalg.norm(np.diff(rows, axis=1), axis=2).sum(axis=1)
    ends = [true_places(sheet, rows[:, k]) for k in (0, -1)]
    return float(np.median(np.linalg.norm(ends[1] - ends[0], axis=1) - along))


def true_places(sheet, points: np.ndarray) -> np.ndarray:
    """(n, 2) places of a flat page whose points in space are next to points (n, 3)."""
    smooth, _ = rounded(sheet, sampled(sheet, noise=0.0)[0])
    places, step = smooth.nearest(points), 1e-3
    for _ in range(5):
        here = sheet.warp(places, PAGE_MM)
        by = [(sheet.warp(places + step * axis, PAGE_MM) - here) / step for axis in np.eye(2)]
        places = places + np.stack([((points - here) * one).sum(axis=1) for one in by], axis=1)
    return places


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


def test_squares_over_a_crease_are_told(spread):
    places = spread.smooth.nearest(
        SPREAD.warp(np.array([[-20.0, 0.0], [-2.0, 10.0], [2.0, 10.0], [30.0, 5.0]]), PAGE_MM)
    )
    assert spread.uncreased(places, 4.0).tolist() == [True, False, False, True]
    assert spread.uncreased(places, 0.5).all()


@pytest.mark.parametrize("sheet", [Wave(slope_deg=30.0, wavelength_mm=120.0), Miura(side_mm=40.0, width_mm=40.0)])
def test_a_page_without_creases_or_with_many_is_left_smooth(sheet):
    points, _ = sampled(sheet)
    smooth, feet = rounded(sheet, points)
    assert fold(points, feet, smooth) is smooth


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

    monkeypatch.setattr("restore.photogrammetry.folded.fit_paper", lost)
    assert fold(points, feet, smooth) is smooth
