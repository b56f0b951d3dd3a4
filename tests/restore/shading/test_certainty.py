"""The error expected of a light is of the size of its true error, and grows with noise, print and distance."""

import numpy as np
import pytest

from restore.shading.certainty import certainty_of
from restore.shading.lamps import fit_light
from restore.shading.surroundings import surroundings_of
from tests.restore.shading.test_lamps import PAPER, ROOM, bowl, lit_by, surface, toward

CAP = 0.15
BLOCKS = 5  # across and down
TIMES = 4.0  # the expected error is a standard error: a true one is seldom three of it, and the blocks are few
NOISE = 0.02  # of the light


@pytest.fixture(scope="module")
def lit():
    """Places of a bowl-shaped page, the true light on them, and the block of each."""
    relief = surface(bowl, 61)
    surroundings = surroundings_of(relief)
    true, places = lit_by([toward(130, 50, 1e-3)], [*ROOM, 0.6 * PAPER], relief, surroundings)
    row, col = np.divmod(np.arange(len(places.points)), 61)
    return places, true, surroundings, row * BLOCKS // 61 * BLOCKS + col * BLOCKS // 61


def checked(lit, chosen, spread, albedo=1.0, seed=3):
    """The certainty of a light fitted to some places of noisy brightness, and its true rms error in logarithms."""
    places, true, surroundings, blocks = lit
    rng = np.random.default_rng(seed)
    light = true.irradiance(places)
    colour = light * albedo * np.exp(spread * rng.standard_normal((len(light), 1)))
    labels = np.ones(len(chosen), int)
    found = fit_light(colour[chosen].astype(np.float32), places[chosen], surroundings, labels)
    brightness = colour[chosen].mean(axis=1)
    reported = certainty_of(found, places, places[chosen], brightness, labels, blocks[chosen], CAP)
    off = np.log(found.irradiance(places).mean(axis=1) / light.mean(axis=1))
    return reported, float(off.std())


def everywhere(lit):
    return np.arange(0, len(lit[0].points), 4)


@pytest.mark.parametrize("spread", [NOISE, 3 * NOISE])
def test_the_expected_error_is_about_the_true_one(lit, spread):
    reported, off = checked(lit, everywhere(lit), spread)
    assert reported.certain
    assert off < TIMES * reported.error
    assert reported.error < reported.variation / 4
    assert reported.variation == pytest.approx(float(np.log(lit[1].irradiance(lit[0]).mean(axis=1)).std()), rel=0.1)


def test_more_noise_is_less_certain(lit):
    assert checked(lit, everywhere(lit), 4 * NOISE)[0].error > 1.5 * checked(lit, everywhere(lit), NOISE)[0].error


def test_a_light_that_is_extrapolated_is_less_certain(lit):
    points = lit[0].points
    corner = np.flatnonzero((points[:, 0] < -40) & (points[:, 1] > 40))
    reported, off = checked(lit, corner, NOISE)
    assert reported.error > 2 * checked(lit, everywhere(lit), NOISE)[0].error
    assert off < TIMES * reported.error


def test_print_that_changes_smoothly_makes_no_light_certain(lit):
    """Even light on a picture of large clouds: the lamps that were fitted to them explain nothing for certain."""
    places, _, surroundings, blocks = lit
    rng = np.random.default_rng(11)
    x, y, _ = places.points.T / 100.0
    waves = sum(np.cos(rng.uniform(3, 9) * x + rng.uniform(3, 9) * y + rng.uniform(0, 6)) for _ in range(6))
    colour = (np.exp(0.25 * waves)[:, None] * PAPER).astype(np.float32)
    chosen, labels = everywhere(lit), np.ones(len(everywhere(lit)), int)
    found = fit_light(colour[chosen], places[chosen], surroundings, labels)
    reported = certainty_of(found, places, places[chosen], colour[chosen].mean(axis=1), labels, blocks[chosen], CAP)
    assert not reported.certain
