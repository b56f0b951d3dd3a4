"""Regions end at edges of print, not at those of the light, and a light is judged by what it leaves within them."""

import numpy as np
import pytest

from restore.shading.regions import regions_of, unexplained

SHAPE = (160, 200)
NOISE = 0.006  # of a code of 1: that of a camera of 8 bits
PAPER, NAVY = np.array([0.85, 0.85, 0.83]), np.array([0.02, 0.03, 0.09])


def level(shape=SHAPE):
    return np.broadcast_to(np.float32([0, 0, 1]), (*shape, 3)).copy()


def pictured(reflectance, light=1.0, seed=1):
    """Linear colour (r, c, 3) of a print in some light, with the noise of a camera."""
    codes = np.clip(reflectance * np.broadcast_to(light, SHAPE)[..., None], 0, 1) ** (1 / 2.2)
    noisy = codes + NOISE * np.random.default_rng(seed).standard_normal(codes.shape)
    return (np.clip(noisy, 0, 1) ** 2.2).astype(np.float32)


def everywhere():
    return np.ones(SHAPE, bool)


def falling():
    """Light that falls off to a third across the page."""
    return np.linspace(1.0, 0.35, SHAPE[1])[None, :]


@pytest.mark.parametrize("ground", [PAPER, NAVY])
def test_a_page_of_one_print_is_one_region_in_any_smooth_light(ground):
    colour = pictured(np.broadcast_to(ground, (*SHAPE, 3)), falling())
    found = regions_of(colour, level(), everywhere())
    assert found.count >= 1
    assert found.largest.mean() > 0.95


def test_patches_of_other_print_are_regions_of_their_own():
    reflectance = np.broadcast_to(PAPER, (*SHAPE, 3)).copy()
    reflectance[40:120, 30:80] = NAVY
    reflectance[40:120, 110:160] = 0.8 * PAPER
    labels = regions_of(pictured(reflectance), level(), everywhere()).labels
    paper, navy, grey = labels[20, 100], labels[80, 55], labels[80, 135]
    assert paper == 1
    assert len({paper, navy, grey}) == 3 and 0 not in (navy, grey)
    assert (labels[50:110, 40:70] == navy).mean() > 0.95


def test_a_step_of_light_at_a_crease_ends_no_region_and_one_on_level_paper_does():
    light = np.where(np.arange(SHAPE[1]) < 100, 1.0, 0.6)[None, :]
    colour = pictured(np.broadcast_to(PAPER, (*SHAPE, 3)), light)
    folded = level()
    folded[:, 100:] = [0.6, 0.0, 0.8]
    assert regions_of(colour, folded, everywhere()).count == 1
    assert regions_of(colour, level(), everywhere()).count == 2


def test_a_figure_that_a_crease_crosses_is_not_paper():
    reflectance = np.broadcast_to(PAPER, (*SHAPE, 3)).copy()
    reflectance[40:120, 60:140] = 0.2 * PAPER
    folded = level()
    folded[:, 100:] = [0.6, 0.0, 0.8]
    labels = regions_of(pictured(reflectance), folded, everywhere()).labels
    assert labels[20, 50] == labels[20, 150] != labels[80, 80]
    assert labels[80, 80] == labels[80, 120] != 0


def test_print_that_fades_from_one_hue_to_another_is_not_a_region_and_paper_under_two_lamps_is():
    across = np.linspace(0, 1, SHAPE[1])[None, :, None]
    sunset = (1 - across) * [0.03, 0.08, 0.3] + across * [0.6, 0.3, 0.06]
    reflectance = np.broadcast_to(sunset, (*SHAPE, 3))
    assert regions_of(pictured(reflectance), level(), everywhere()).count == 0
    lamps = (1 - across) * [1.0, 0.9, 0.8] + across * [0.8, 0.9, 1.0]
    assert regions_of(pictured(PAPER * lamps), level(), everywhere()).largest.mean() > 0.95


def test_off_the_page_lies_no_region():
    inside = everywhere()
    inside[:60] = False
    found = regions_of(pictured(np.broadcast_to(PAPER, (*SHAPE, 3))), level(), inside)
    assert not found.labels[:60].any()
    assert regions_of(pictured(np.broadcast_to(PAPER, (*SHAPE, 3))), level(), ~everywhere()).count == 0


def test_the_true_light_leaves_nothing_whatever_the_albedos():
    rng = np.random.default_rng(2)
    labels = rng.integers(1, 5, 1000)
    light = rng.uniform(0.3, 1.0, 1000)
    brightness = light * np.array([0.0, 0.9, 0.02, 0.4, 0.1])[labels]
    np.testing.assert_allclose(unexplained(brightness, light, labels, 0.15), 0, atol=1e-12)
    assert unexplained(brightness, np.ones(1000), labels, 0.15).max() == pytest.approx(0.15**2)
