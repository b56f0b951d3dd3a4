"""A sheet of paper through points, against exact sheets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivers.simulated import Cone, Curl, Wave
from restore.photogrammetry.cameras.align import Similarity
from restore.photogrammetry.errors import SheetLost
from restore.photogrammetry.surfaces import surface as surface_module
from restore.photogrammetry.surfaces.surface import (
    STIFFNESSES,
    Surface,
    choose_stiffness,
    fit_surface,
    grid_places,
    through_places,
)

PAGE_MM = (200.0, 140.0)
LOW, HIGH = -np.array(PAGE_MM) / 2, np.array(PAGE_MM) / 2
RNG = np.random.default_rng(1)
PLACES = RNG.uniform(LOW + 8, HIGH - 8, (5000, 2))
OFF_MM = 1.0  # by which the start is off: as much as a surface through features
EXACT_MM = 0.01  # what a spline of 6 mm leaves of bends of this kind
ROLL = Curl(radius_mm=75.0, taper=0.2)  # its ends stand at 80 degrees and more
SHEETS = (ROLL, Wave(slope_deg=30.0, wavelength_mm=90.0), Cone(apex_mm=260.0, opening_deg=35.0))


def started(sheet) -> Surface:
    """A surface near a sheet, of the same u and v."""
    places = grid_places(LOW - 25, HIGH + 25, 6.0)
    points = sheet.warp(places, PAGE_MM)
    return through_places(places, points + OFF_MM * np.sin(places[:, :1] / 25) * [0, 0, 1], LOW - 25, HIGH + 25)


def fitted(sheet, places, *, noise=0.0, stiffness=10.0) -> Surface:
    points = sheet.warp(places, PAGE_MM) + noise * np.random.default_rng(2).standard_normal((len(places), 3))
    start = started(sheet)
    return fit_surface(points, start.nearest(points), start, stiffness=stiffness)[0]


def distances(surface, sheet, places) -> np.ndarray:
    points = sheet.warp(places, PAGE_MM)
    return np.linalg.norm(points - surface.points(surface.nearest(points)), axis=1)


def rms(values) -> float:
    return float(np.sqrt((values**2).mean()))


@pytest.mark.parametrize("sheet", SHEETS, ids=lambda sheet: sheet.name)
def test_sheets_are_followed_where_they_stand_upright_too(sheet):
    within = RNG.uniform(LOW + 10, HIGH - 10, (500, 2))
    assert rms(distances(fitted(sheet, PLACES), sheet, within)) < EXACT_MM


@pytest.mark.parametrize("sheet", SHEETS, ids=lambda sheet: sheet.name)
def test_a_blank_area_prolongs_the_rulings(sheet):
    half = np.array([35.0, 30.0])  # of an area of 70 × 60 mm without points
    blank = RNG.uniform(-half, half, (500, 2))
    outside = PLACES[~(np.abs(PLACES) < half).all(axis=1)]
    assert rms(distances(fitted(sheet, outside, noise=0.02, stiffness=100.0), sheet, blank)) < 0.05


@pytest.mark.parametrize("sheet", SHEETS, ids=lambda sheet: sheet.name)
def test_the_sheet_does_not_stretch(sheet):
    by = fitted(sheet, PLACES, noise=0.02, stiffness=100.0).derivatives(PLACES)
    lengths = np.linalg.norm(by[:, 1:3], axis=2)
    assert np.abs(lengths - 1).max() < 2e-3
    assert np.abs((by[:, 1] * by[:, 2]).sum(axis=1)).max() < 2e-3


def test_noise_is_averaged():
    within = RNG.uniform(LOW + 10, HIGH - 10, (500, 2))
    assert rms(distances(fitted(ROLL, PLACES, noise=0.05, stiffness=1e4), ROLL, within)) < 0.05 / 4


def test_points_far_off_have_no_weight():
    points = ROLL.warp(PLACES, PAGE_MM)
    points[::20, 2] += 5.0
    start = started(ROLL)
    surface, _ = fit_surface(points, start.nearest(points), start, stiffness=100.0)
    assert rms(distances(surface, ROLL, PLACES[1::20])) < 0.03


def test_a_flat_page_gets_a_stiffer_surface_than_a_wave():
    wave = Wave(slope_deg=30.0, wavelength_mm=60.0)
    noise = 0.05 * RNG.standard_normal(len(PLACES))[:, None] * [0, 0, 1]
    level = Surface.level(LOW - 10, HIGH + 10, 0.0)
    flat = choose_stiffness(np.column_stack([PLACES, np.zeros(len(PLACES))]) + noise, PLACES, level)
    points, start = wave.warp(PLACES, PAGE_MM) + noise, started(wave)
    assert flat > 10 * choose_stiffness(points, start.nearest(points), start)


def test_a_level_surface_is_where_it_is_said_to_be():
    level = Surface.level(LOW, HIGH, 3.0)
    np.testing.assert_allclose(level.points(PLACES), np.column_stack([PLACES, np.full(len(PLACES), 3.0)]), atol=1e-9)
    bounds = np.array(level.bounds)
    assert (bounds[0] <= LOW).all() and (bounds[1] >= HIGH).all()


def test_a_level_surface_rises_to_points_when_it_may_stretch():
    points = np.column_stack([PLACES, 4.0 + 8.0 * np.cos(PLACES[:, 0] / 20)])
    level = Surface.level(LOW - 10, HIGH + 10, 0.0)
    surface, feet = fit_surface(points, PLACES, level, stiffness=10.0, inextensible=False)
    assert rms(np.linalg.norm(points - surface.points(feet), axis=1)) < 0.05


def test_a_steep_wave_is_followed_when_it_may_stretch():
    wave = Wave(slope_deg=38.0, wavelength_mm=90.0, angle_deg=25.0)
    points = wave.warp(PLACES, PAGE_MM) + 0.25 * RNG.standard_normal((len(PLACES), 3))
    level = Surface.level(LOW - 30, HIGH + 30, float(np.median(points[:, 2])))
    surface, feet = fit_surface(points, points[:, :2], level, stiffness=1e4, inextensible=False)
    assert rms(np.linalg.norm(points - surface.points(feet), axis=1)) < 0.6  # noise of √3 · 0.25 and the bends


def test_derivatives_are_those_of_the_points():
    surface, step = fitted(ROLL, PLACES), 1e-3
    along, up = np.array([step, 0.0]), np.array([0.0, step])
    by = surface.derivatives(PLACES[:200])

    def difference(order, shift):
        ahead, behind = surface.derivatives(PLACES[:200] + shift), surface.derivatives(PLACES[:200] - shift)
        return (ahead[:, order] - behind[:, order]) / 2 / step

    np.testing.assert_allclose(by[:, 1], difference(0, along), atol=1e-6)
    np.testing.assert_allclose(by[:, 2], difference(0, up), atol=1e-6)
    np.testing.assert_allclose(by[:, 3], difference(1, along), atol=1e-4)
    np.testing.assert_allclose(by[:, 4], difference(1, up), atol=1e-4)
    np.testing.assert_allclose(by[:, 5], difference(2, up), atol=1e-4)


def test_frames_osculate_the_surface():
    surface = fitted(ROLL, PLACES)
    points, tangents, normals, bends = surface.frames(PLACES[:300])
    np.testing.assert_allclose(np.einsum("nki,ni->nk", tangents, normals), 0.0, atol=1e-12)
    a, b = 1.5, -1.0
    rise = 0.5 * (bends @ [a * a, 2 * a * b, b * b])
    near = points + a * tangents[:, 0] + b * tangents[:, 1] + rise[:, None] * normals
    off = np.linalg.norm(near - surface.points(surface.nearest(near)), axis=1)
    assert off.max() < 0.002  # of third order
    assert np.abs(rise).max() > 0.01


def test_feet_are_next_to_their_points():
    surface = fitted(ROLL, PLACES)
    on = surface.points(PLACES[:300])
    off = on + 0.7 * surface.normals(PLACES[:300])
    np.testing.assert_allclose(surface.feet(off, PLACES[:300] + 3.0), PLACES[:300], atol=1e-5)
    np.testing.assert_allclose(surface.nearest(off), PLACES[:300], atol=1e-5)


def test_a_surface_moves_and_grows_with_its_page():
    surface = fitted(ROLL, PLACES)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    change = Similarity(1.5, turn, np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(surface.moved(change).points(PLACES), change.points(surface.points(PLACES)), atol=1e-9)
    larger = surface.within(LOW - 40, HIGH + 40)
    assert rms(np.linalg.norm(larger.points(PLACES) - surface.points(PLACES), axis=1)) < EXACT_MM


def test_points_that_slide_off_the_sheet_are_reported():
    wave = SHEETS[1]
    start = started(wave)
    points = wave.warp(PLACES, PAGE_MM) + [0.0, 400.0, 0.0]  # beyond the sheet's edge, at any start
    with pytest.raises(SheetLost, match="no sheet of paper"):
        fit_surface(points, PLACES + [0.0, 400.0], start, stiffness=10.0)


def test_a_paper_with_which_the_sheet_is_lost_is_not_chosen(monkeypatch):
    wave, fit = SHEETS[1], surface_module.fit_paper

    def lost_when_stiff(points, feet, start, paper, **how):
        if paper.stiffness > 100.0:
            raise SheetLost("slid off")
        return fit(points, feet, start, paper, **how)

    monkeypatch.setattr(surface_module, "fit_paper", lost_when_stiff)
    start = started(wave)
    points = wave.warp(PLACES, PAGE_MM)
    assert choose_stiffness(points, start.nearest(points), start) in [s for s in STIFFNESSES if s <= 100.0]


def test_a_sheet_that_is_torn_beyond_all_numbers_is_reported():
    rng = np.random.default_rng(0)
    level = Surface.level(np.array([-40.0, -40.0]), np.array([40.0, 40.0]), 0.0)
    torn = replace(level, coefficients=level.coefficients + 1e160 * rng.normal(size=level.coefficients.shape))
    feet = rng.uniform(-35, 35, (200, 2))
    with np.errstate(all="ignore"), pytest.raises(SheetLost, match="no sheet of paper"):
        fit_surface(np.column_stack([feet, np.zeros(200)]), feet, torn, stiffness=10.0)


@pytest.mark.parametrize("turn", [[[0.0, 1.0], [-1.0, 0.0]], [[-1.0, 0.0], [0.0, -1.0]]])
def test_a_surface_through_points_does_not_depend_on_how_their_places_are_turned(turn):
    places, half = np.random.default_rng(3).uniform(-30.0, 30.0, (400, 2)), np.array([60.0, 60.0])
    points = np.column_stack([places, 0.01 * places[:, 0] ** 2])
    beyond = np.array([[42.0, 0.0], [-42.0, 5.0]])  # where only its own stiffness determines it
    level, turned = (through_places(places @ way, points, -half, half) for way in (np.eye(2), np.array(turn)))
    np.testing.assert_allclose(turned.points(beyond @ np.array(turn)), level.points(beyond), atol=1e-6)
