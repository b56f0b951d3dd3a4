"""The colour of the lamp is divided out with that of bare paper, and kept where no paper is found."""

import numpy as np
import pytest

from restore.numerics.srgb import LINEAR, srgb_codes
from restore.shading.white import balance_on_paper

DPI = 100.0
PAPER, INK, RED = (232, 232, 232), (50, 50, 50), (200, 60, 50)
WARM, COOL = np.array([1.0, 0.72, 0.45]), np.array([0.75, 0.9, 1.0])
ROUNDED = 1.5  # codes: the picture is rounded once under the lamp and once after it
NEUTRAL = 1  # code, between the channels of paper


def page():
    """White paper with bars of ink and a red field, (h, w, 3) uint8, and where it is bare and red."""
    image = np.full((400, 560, 3), PAPER, np.uint8)
    image[60:340:16, 60:300] = image[61:340:16, 60:300] = INK
    red = np.zeros(image.shape[:2], bool)
    red[100:300, 350:500] = True
    image[red] = RED
    return image, (image == PAPER).all(axis=2), red


def under(image, lamp):
    return srgb_codes(LINEAR[image] * lamp)


def everywhere(image):
    return np.ones(image.shape[:2], bool)


@pytest.mark.parametrize("lamp", [WARM, COOL])
def test_paper_is_neutral_afterwards_and_ink_has_its_colour_again(lamp):
    image, bare, red = page()
    seen = under(image, lamp)
    result = balance_on_paper(seen, everywhere(seen), DPI)
    assert result.report["balanced"]
    assert np.ptp(seen[bare].mean(axis=0)) > 20
    assert np.ptp(result.image[bare].astype(int), axis=1).max() <= NEUTRAL
    light = LINEAR[result.image[red]].mean(axis=0) / LINEAR[result.image[bare]].mean(axis=0)
    truth = LINEAR[list(RED)] / LINEAR[list(PAPER)]
    np.testing.assert_allclose(srgb_codes(light), srgb_codes(truth), atol=ROUNDED)


def test_the_luminance_of_the_paper_and_all_outside_the_page_stay():
    image, bare, _ = page()
    seen, mask = under(image, WARM), everywhere(image)
    mask[:, :40] = False
    result = balance_on_paper(seen, mask, DPI)
    np.testing.assert_array_equal(result.image[~mask], seen[~mask])
    before, after = (LINEAR[one[bare & mask]].mean(axis=0) @ [0.2126, 0.7152, 0.0722] for one in (seen, result.image))
    assert after == pytest.approx(before, rel=0.01)  # one code of 200


def test_neutral_paper_is_left_alone():
    image, _, _ = page()
    np.testing.assert_allclose(balance_on_paper(image, everywhere(image), DPI).image, image, atol=1)


@pytest.mark.parametrize("kind", ["navy", "noise", "nothing"])
def test_without_bare_paper_the_colours_stay_and_the_reason_is_given(kind):
    image = np.full((300, 400, 3), (30, 36, 82), np.uint8)
    if kind == "noise":
        image = np.random.default_rng(3).integers(0, 256, (300, 400, 3), dtype=np.uint8).repeat(2, 0).repeat(2, 1)
    mask = np.full(image.shape[:2], kind != "nothing")
    result = balance_on_paper(image, mask, DPI)
    assert result.image is image
    assert not result.report["balanced"]
    assert result.report["reason"]
