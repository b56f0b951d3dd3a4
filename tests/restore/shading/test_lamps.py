"""Lamps are found again from the paper that they light, wherever they stand, and ink does not mislead."""

from dataclasses import replace

import numpy as np
import pytest

from restore.shading.horizon_map import AZIMUTHS, horizon_map, in_sight
from restore.shading.lamps import _normal_equations, _strengths, at_bounds, fit_light
from restore.shading.light import Light
from restore.shading.relief import Relief
from restore.shading.surroundings import Places, surroundings_of

REACH = 100.0  # mm, half of the page
DEGREES = 10.0  # where no place turns away from a lamp, its direction is shared with the slopes of the room's light
EXPLAINED = 0.01  # of the light: the fit's own floor
PAPER = np.array([0.85, 0.85, 0.83])
REFLECTANCE = 0.8
MAP = 0.05  # tangent: the edge of a wall is met within a step, a tenth of its distance


def surface(height, count=81):
    """A relief with height(x, y) mm over a page of 200 × 200 mm, its normals exact to the mesh."""
    steps = np.linspace(-REACH, REACH, count)
    x, y = np.meshgrid(steps, steps[::-1])
    z = height(x, y)
    down, right = np.gradient(z, steps[1] - steps[0])
    normals = np.dstack([-right, down, np.ones_like(z)])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    k = np.arange(count * count).reshape(count, count)
    a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[:-1, 1:], k[1:, :-1], k[1:, 1:]))
    faces = np.concatenate([np.stack([a, c, d], 1), np.stack([a, d, b], 1)])
    points = np.dstack([x, y, z])
    fields = (field.astype(np.float32) for field in (points, normals))
    return Relief(*fields, 10.0, points.reshape(-1, 3), faces, np.eye(3), np.zeros(3))


def bowl(x, y):
    return (x**2 + 0.5 * y**2) / 250.0


def gutter(x, y):
    return np.maximum(0.0, 40.0 - np.abs(x)) * -1.5


def places_on(relief, surroundings):
    points, normals = relief.points.reshape(-1, 3), relief.normals.reshape(-1, 3)
    return Places(points, normals, np.ones(len(points), np.float32), surroundings.horizon.nodes(points))


def lit_by(lamps, strengths, relief, surroundings, reflectance=REFLECTANCE):
    places = places_on(relief, surroundings)
    lamps, strengths = np.array(lamps, float).reshape(-1, 3), np.array(strengths, float)
    return Light(lamps, reflectance, strengths, places.points.mean(axis=0), surroundings), places


def toward(azimuth, polar, nearness):
    return np.array([np.radians(azimuth), np.radians(polar), nearness])


def vector(lamp):
    azimuth, polar, _ = lamp
    return np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])


ROOM = [0.4 * PAPER, 0 * PAPER, 0 * PAPER, 0 * PAPER]


def test_a_light_of_one_colour_is_as_bright_and_has_the_colour_of_the_level():
    relief = surface(bowl)
    lamps = [toward(135, 40, 1e-3), toward(-20, 60, 1e-3)]
    strengths = [*ROOM, 0.3 * PAPER * [1.2, 1.0, 0.8], 0.3 * PAPER * [0.8, 1.0, 1.2]]
    light, places = lit_by(lamps, strengths, relief, surroundings_of(relief))
    plain = light.of_one_colour.irradiance(places)
    np.testing.assert_allclose(plain.mean(axis=1), light.irradiance(places).mean(axis=1), rtol=EXPLAINED)
    hue = light.level / light.level.mean()
    np.testing.assert_allclose(plain, plain.mean(axis=1, keepdims=True) * hue, rtol=EXPLAINED)
    assert np.ptp(light.irradiance(places)[:, 0] / light.irradiance(places)[:, 2]) > EXPLAINED


@pytest.mark.parametrize("azimuth, polar, distance", [(135, 40, 900.0), (-20, 60, 600.0), (80, 50, 1500.0)])
def test_a_near_lamp_is_found_where_it_stands(azimuth, polar, distance):
    relief = surface(bowl)
    surroundings = surroundings_of(relief)
    true, places = lit_by([toward(azimuth, polar, 1 / distance)], [*ROOM, 0.6 * PAPER], relief, surroundings)
    colour = true.irradiance(places)
    found = fit_light(colour[::6], places[np.arange(0, len(colour), 6)], surroundings)
    off = np.abs(found.irradiance(places) / colour - 1)
    assert np.percentile(off, 95) < EXPLAINED
    strongest = found.lamps[found.strengths[4:, 0].argmax()]
    angle = np.degrees(np.arccos(np.clip(vector(strongest) @ vector(true.lamps[0]), -1, 1)))
    assert angle < DEGREES
    assert found.level == pytest.approx(true.level, rel=2 * EXPLAINED)
    assert found.reflectance == pytest.approx(REFLECTANCE, abs=0.1)  # by a tenth of the light, known to a hundredth


def test_regions_of_unknown_albedo_show_the_light_as_paper_does():
    relief = surface(bowl)
    surroundings = surroundings_of(relief)
    true, places = lit_by([toward(135, 40, 1e-3)], [*ROOM, 0.6 * PAPER], relief, surroundings)
    chosen = np.arange(0, len(places.points), 6)
    x, y, _ = places.points[chosen].T
    labels = 1 + (x > 20).astype(int) + 2 * (y > -30).astype(int)
    albedo = np.array([[0, 0, 0], [0.02, 0.03, 0.08], [0.9, 0.9, 0.9], [0.4, 0.1, 0.1], [0.05, 0.3, 0.1]])[labels]
    found = fit_light(
        (albedo * true.irradiance(places)[chosen]).astype(np.float32), places[chosen], surroundings, labels
    )
    ratio = found.irradiance(places) / true.irradiance(places)
    assert np.percentile(np.abs(ratio / np.median(ratio, axis=0) - 1), 95) < EXPLAINED
    assert np.median(ratio, axis=0) == pytest.approx(albedo[labels == 1][0], rel=EXPLAINED)


def test_two_lamps_of_two_colours_are_distinguished():
    relief = surface(bowl)
    surroundings = surroundings_of(relief)
    warm, cool = np.array([0.5, 0.45, 0.35]), np.array([0.2, 0.22, 0.28])
    true, places = lit_by([toward(170, 45, 1e-3), toward(10, 65, 5e-4)], [*ROOM, warm, cool], relief, surroundings)
    colour = true.irradiance(places)
    found = fit_light(colour[::6], places[np.arange(0, len(colour), 6)], surroundings)
    assert np.percentile(np.abs(found.irradiance(places) / colour - 1), 90) < 2 * EXPLAINED


def test_ink_does_not_mislead():
    """Figures on a third of the page, darker and lighter: the light is that of the paper all the same."""
    relief = surface(bowl)
    surroundings = surroundings_of(relief)
    true, places = lit_by([toward(135, 40, 1e-3)], [*ROOM, 0.6 * PAPER], relief, surroundings)
    rng = np.random.default_rng(2)
    ink = (np.abs(places.points[:, 0] - 20) < 45) & (np.abs(places.points[:, 1]) < 60)
    tone = np.where(ink, rng.uniform(0.1, 0.8, len(ink)), 1.0)
    colour = (true.irradiance(places) * tone[:, None]).astype(np.float32)
    chosen = np.arange(0, len(colour), 6)
    found = fit_light(colour[chosen], places[chosen], surroundings)
    assert 0.2 < ink.mean() < 0.4
    assert np.percentile(np.abs(found.irradiance(places) / true.irradiance(places) - 1), 95) < 2 * EXPLAINED


def test_even_light_needs_no_lamp():
    relief = surface(bowl)
    surroundings = surroundings_of(relief)
    _, places = lit_by([], ROOM, relief, surroundings)
    found = fit_light(np.tile(PAPER, (1000, 1)).astype(np.float32), places[np.arange(1000)], surroundings)
    assert len(found.lamps) == 0
    np.testing.assert_allclose(found.irradiance(places), np.tile(PAPER, (len(places.points), 1)), rtol=EXPLAINED)


def test_the_horizon_of_a_wall_is_its_height_over_its_distance():
    relief = surface(lambda x, y: np.clip((x - 40.0) * 4.0, 0.0, 20.0))
    horizon = horizon_map(relief)
    at = np.array([[[0.0, 0.0, 0.0], [20.0, 10.0, 0.0]]], np.float32)
    (col, row), (nearer_col, nearer_row) = horizon.nodes(at)[0].round().astype(int)
    east, west = 0, AZIMUTHS // 2
    assert horizon.slopes[row, col, east] == pytest.approx(20 / 45, abs=MAP)
    assert horizon.slopes[nearer_row, nearer_col, east] == pytest.approx(20 / 25, abs=2 * MAP)
    assert horizon.slopes[row, col, west] == pytest.approx(0.0, abs=MAP)


def test_behind_a_wall_a_low_lamp_is_not_seen_and_a_high_one_is():
    relief = surface(lambda x, y: np.clip((x - 40.0) * 4.0, 0.0, 20.0))
    horizon = horizon_map(relief)
    col, row = horizon.nodes(np.zeros((1, 3), np.float32))[0]
    low, high, behind = (
        in_sight(horizon.slopes, col, row, *way) for way in ((1.0, 0.0, 0.3), (1.0, 0.0, 0.6), (-1.0, 0.0, 0.1))
    )
    assert (low, high, behind) == (0.0, 1.0, 1.0)


def test_hollows_see_less_of_the_room_than_level_paper():
    level = horizon_map(surface(lambda x, y: 0.0 * x)).openness
    np.testing.assert_allclose(level, 1.0, atol=EXPLAINED)
    hollow = horizon_map(surface(gutter)).openness
    rows, cols = hollow.shape
    across = hollow[rows // 2]
    # Two walls of slope 1.5 see each other: at the bottom cos of the steeper half-angle is left.
    bottom = across[cols // 2 - 2 : cols // 2 + 2].mean()
    assert bottom < 0.75 < across[cols // 8]


def test_the_light_of_the_whole_page_is_the_sum_of_its_terms():
    relief = surface(gutter)
    surroundings = surroundings_of(relief)
    light, places = lit_by([toward(30, 50, 1e-3)], [*ROOM, 0.6 * PAPER], relief, surroundings)
    room = replace(light, lamps=np.empty((0, 3)), strengths=light.strengths[:4])
    lamp = replace(light, strengths=np.vstack([0 * light.strengths[:4], light.strengths[4:]]))
    np.testing.assert_allclose(
        light.irradiance(places), room.irradiance(places) + lamp.irradiance(places), rtol=1e-5, atol=1e-6
    )


@pytest.mark.parametrize(
    ("polar", "distance", "expected"), [(60.0, 900.0, False), (90.0, 900.0, True), (60.0, 200.0, True)]
)
def test_a_lamp_at_the_horizon_or_as_near_as_one_may_be_was_not_found(polar, distance, expected):
    lamps = np.array([[0.3, np.radians(polar), 1 / distance]])
    light = Light(lamps, 0.5, np.ones((5, 3)), np.zeros(3, np.float32), None)
    assert at_bounds(light) is expected


def test_the_room_takes_no_light_away_from_any_side():
    """All places face a lamp, so that a slope alone would explain their brightness."""
    azimuth, polar = (part.ravel() for part in np.meshgrid(np.linspace(0, 6, 20), np.linspace(0, 1.2, 9)))
    x, y, z = np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)
    terms = np.column_stack([np.ones_like(x), x, y, z])
    mean, *slopes = _strengths(*_normal_equations(terms, z, np.ones_like(z)))
    assert mean == pytest.approx(np.linalg.norm(slopes) / 2)
    assert np.degrees(np.arccos(slopes[2] / np.linalg.norm(slopes))) < 1.0
    even = _strengths(*_normal_equations(terms, 0.6 + 0.4 * z, np.ones_like(z)))
    assert even == pytest.approx([0.6, 0.0, 0.0, 0.4], abs=EXPLAINED)
