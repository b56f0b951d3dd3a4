"""The ground of a page gives its light away; pale tints and greys keep theirs, however large they are."""

import numpy as np
import pytest

from restore.shading.residual import residual_light

SHAPE, DPI = (280, 360), 60.0
NOISE = 0.008  # of the light: a cell of paper by a camera of 8 bits
SMALL = 0.01  # of the light: the mean over some hundred cells, and a smooth surface at its border
SOFT = 0.06  # of the light: the outermost of a stain is no more tinted than noise, and is taken for paper
TINTS = {"pink": (0.97, 0.90, 0.91), "green": (0.91, 0.97, 0.92), "grey": (0.93, 0.93, 0.93), "mid-grey": (0.5,) * 3}


def level():
    return np.broadcast_to(np.float32([0, 0, 1]), (*SHAPE, 3)).copy()


def everywhere():
    return np.ones(SHAPE, bool)


def falling():
    """A smooth residual from 1.1 to 0.8 across the page."""
    return np.linspace(1.1, 0.8, SHAPE[1])[None, :, None]


def seen(reflectance, light=1.0, seed=1):
    noise = 1 + NOISE * np.random.default_rng(seed).standard_normal((*SHAPE, 3))
    return (reflectance * light * noise).astype(np.float32)


def field(tint, side):
    """A page of paper with a square field, (r, c, 3), and where the field is."""
    where = np.zeros(SHAPE, bool)
    where[20 : 20 + side, 30 : 30 + side] = True
    return np.where(where[..., None], tint, 1.0), where


def surface_and_ground(*page):
    found = residual_light(*page)
    return found.surface, found.ground


@pytest.mark.parametrize("tint", TINTS)
@pytest.mark.parametrize(("side", "light"), [(20, falling()), (60, falling()), (200, 1.0)])
def test_a_tint_keeps_its_contrast_to_the_paper(tint, side, light):
    """Under 85 mm of print the light is carried on from its border alone, so there it is even."""
    reflectance, where = field(TINTS[tint], side)
    colour = seen(reflectance, light)
    found, ground = surface_and_ground(colour, level(), everywhere(), DPI)
    assert ground[where].mean() < 0.1
    left = (colour / found)[where].mean(axis=0) / (colour / found)[ground].mean(axis=0)
    np.testing.assert_allclose(left, TINTS[tint], atol=2 * SMALL)


def test_a_smooth_residual_is_found_on_the_ground():
    colour = seen(np.ones((*SHAPE, 3)), falling())
    found, ground = surface_and_ground(colour, level(), everywhere(), DPI)
    assert ground.mean() > 0.9
    inner = np.s_[20:-20, 20:-20]
    np.testing.assert_allclose((found / falling())[inner] / np.median(found / falling()), 1, atol=SMALL)


def test_paper_behind_a_line_joins_the_ground_and_print_of_another_colour_does_not():
    reflectance, frame = field((0.1,) * 3, 120)
    inner = frame.copy()
    inner[:30] = inner[130:] = False
    inner[:, :40] = inner[:, 140:] = False
    reflectance[inner] = 1.0
    _, ground = surface_and_ground(seen(reflectance), level(), everywhere(), DPI)
    assert ground[50:120, 60:120].mean() > 0.9
    reflectance[inner] = TINTS["green"]
    _, ground = surface_and_ground(seen(reflectance), level(), everywhere(), DPI)
    assert ground[50:120, 60:120].mean() < 0.1


def test_a_soft_brown_stain_is_print_though_it_has_no_edge():
    """Light from lamps of the same colours has no tint of its own."""
    rows, cols = np.indices(SHAPE)
    stain = 0.4 * np.exp(-((rows - 140) ** 2 + (cols - 180) ** 2) / (2 * 40.0**2))[..., None]
    reflectance = 1 - stain * [0.1, 0.4, 0.9]
    colour = seen(reflectance)
    found, _ = surface_and_ground(colour, level(), everywhere(), DPI)
    np.testing.assert_allclose((colour / found)[130:150, 170:190].mean(axis=(0, 1)), reflectance[140, 180], atol=SOFT)


def test_without_the_colour_of_the_ground_the_residual_is_unknown():
    """The light was fitted to another print, so small that it says nothing here."""
    found, ground = surface_and_ground(seen(np.full((*SHAPE, 3), 0.3), falling()), level(), everywhere(), DPI)
    assert not ground.any()
    np.testing.assert_array_equal(found, 1)


def test_off_the_page_the_ground_is_unknown():
    inside = everywhere()
    inside[:100] = False
    _, ground = surface_and_ground(seen(np.ones((*SHAPE, 3))), level(), inside, DPI)
    assert not ground[:100].any()
    nothing, ground = surface_and_ground(seen(np.ones((*SHAPE, 3))), level(), ~everywhere(), DPI)
    assert not ground.any()
    np.testing.assert_allclose(nothing, 1)
