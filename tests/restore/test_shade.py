"""Light and shadow are divided out of a page; paper, ink and everything outside stay what they are."""

import numpy as np
import pytest

from restore.shade import MAX_GAIN, remove_shading
from restore.texture import MM_PER_INCH

DPI = 100.0
PAPER, INK = 232.0, np.array([50.0, 46.0, 52.0])
# Grey levels. A cell of the coarse grid may be a fifth ink and pass for paper, which darkens the light between words by
# up to 4 %; at the border the light is averaged on one side only.
EVEN = 6.0
WORST = 10.0
ROUNDED = 1.5


def page(dpi=DPI):
    """Paper of 180 × 130 mm with lines of text, (h, w, 3) in reflected light, and where it is bare."""
    height, width = (round(side / MM_PER_INCH * dpi) for side in (130.0, 180.0))
    y, x = (axis / dpi * MM_PER_INCH for axis in np.mgrid[:height, :width])
    words = (y % 5.0 < 2.0) & (x % 9.4 < 7.4) & (x % 1.27 < 0.76) & (y > 12) & (y < 118) & (x > 12) & (x < 168)
    return np.where(words[..., None], INK, PAPER), ~words


def lit(reflectance, light):
    return np.clip(reflectance * light[..., None] + 0.5, 0, 255).astype(np.uint8)


def lamp(shape):
    """Light that falls off smoothly to 55 % from the upper left to the lower right."""
    rows, cols = (axis / extent for axis, extent in zip(np.indices(shape[:2]), shape, strict=False))
    return 1.0 - 0.3 * rows - 0.15 * cols**2


def everywhere(image):
    return np.ones(image.shape[:2], bool)


@pytest.mark.parametrize("dpi", [DPI, 200.0])
def test_a_page_in_falling_light_comes_back_even(dpi):
    reflectance, bare = page(dpi)
    image = lit(reflectance, lamp(reflectance.shape))
    evened = remove_shading(image, everywhere(image), dpi).astype(float)
    expected = reflectance * np.median(evened[bare] / reflectance[bare])
    assert np.ptp(image[bare][:, 0].astype(float)) > 90  # what the light had done
    assert np.percentile(np.abs(evened - expected), 99) < EVEN
    assert np.abs(evened - expected)[bare].max() < WORST


def test_a_page_in_even_light_stays_as_it_is():
    reflectance, _ = page()
    image = lit(reflectance, np.full(reflectance.shape[:2], 0.9))
    change = np.abs(remove_shading(image, everywhere(image), DPI).astype(float) - image)
    assert change.max() < WORST
    assert change[:40].max() <= ROUNDED  # where there are no words


def test_coloured_paper_in_coloured_light_becomes_white_paper():
    """The colour of the paper under its lamp is taken for the light's: as on a copier, paper is white."""
    image = np.full((300, 400, 3), (200, 180, 120), np.uint8)
    np.testing.assert_allclose(remove_shading(image, everywhere(image), DPI), 200, atol=ROUNDED)


@pytest.mark.parametrize("side_mm", [15.0, 30.0, 60.0])
def test_a_figure_is_not_taken_for_a_shadow(side_mm):
    """Solid ink: the light is carried across it from the paper round it."""
    reflectance, _ = page()
    figure = np.zeros(reflectance.shape[:2], bool)
    side = round(side_mm / MM_PER_INCH * DPI)
    figure[200 : 200 + side, 300 : 300 + side] = True
    reflectance[figure] = INK
    image = lit(reflectance, lamp(reflectance.shape))
    evened = remove_shading(image, everywhere(image), DPI).astype(float)
    white = np.percentile(evened[~figure].max(axis=1), 90)
    assert np.abs(evened[figure] - INK * white / PAPER).max() < WORST


@pytest.mark.parametrize("share, lifted", [(1.5 / MAX_GAIN, True), (0.5 / MAX_GAIN, False)])
def test_a_shadow_is_lifted_unless_it_is_so_deep_that_only_noise_is_left(share, lifted):
    image = np.full((400, 600, 3), 200, np.uint8)
    image[:, 300:] = round(200 * share)
    evened = remove_shading(image, everywhere(image), DPI)
    np.testing.assert_allclose(evened[:, :200], 200, atol=ROUNDED)
    np.testing.assert_allclose(evened[:, 400:], 200 if lifted else image[0, -1, 0], atol=WORST)


def test_outside_the_mask_nothing_changes_and_inside_nothing_leaks_in():
    reflectance, _ = page()
    image = lit(reflectance, lamp(reflectance.shape))
    mask = everywhere(image)
    mask[:, :60] = mask[:80] = False
    outside = image.copy()
    outside[~mask] = 255
    evened = remove_shading(outside, mask, DPI)
    np.testing.assert_array_equal(evened[~mask], 255)
    black = np.where(mask[..., None], image, 0).astype(np.uint8)
    np.testing.assert_array_equal(remove_shading(black, mask, DPI)[mask], evened[mask])


@pytest.mark.parametrize("shape", [(1, 1), (2, 40), (300, 1)])
def test_scraps_and_an_empty_mask_come_back(shape):
    image = np.full((*shape, 3), 120, np.uint8)
    nowhere = np.zeros(shape, bool)
    np.testing.assert_array_equal(remove_shading(image, nowhere, DPI), image)
    assert remove_shading(image, ~nowhere, DPI).shape == image.shape
