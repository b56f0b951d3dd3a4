"""Light and shadow are divided out of a page; paper, ink and everything outside stay what they are."""

import cv2
import numpy as np
import pytest

from drivers.simulated.scene.albedo import srgb
from restore.numerics.srgb import LINEAR, srgb_codes
from restore.shading import divide as module
from restore.shading.relief import Relief
from restore.shading.remove import LIGHT_DPI, MAX_GAIN, find_light
from restore.texture.page import MM_PER_INCH

DPI = 100.0
PAPER, INK = 232.0, np.array([50.0, 46.0, 52.0])
# Grey levels. A shape without relief explains nothing: what follows a lamp here is the smooth surface alone, which at
# the border is averaged on one side only.
EVEN = 6.0
WORST = 10.0
ROUNDED = 1.5
DEEP, ROUNDING = 20, 1.03  # a shadow of 1 % of the light; half a code of fifty
TINT = 0.02  # relative
BLUR = 4  # pixels: takes the noise out, and reaches three times as far
CONTRAST = 0.15  # relative: dark codes hold few steps of light, and both parts end in the blur of their edges


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


def flat(shape, dpi=DPI):
    """The relief of a level page."""
    rows, cols = (max(2, round(n * LIGHT_DPI / dpi)) for n in shape[:2])
    step = MM_PER_INCH / LIGHT_DPI
    x, y = np.meshgrid((np.arange(cols) + 0.5) * step, -(np.arange(rows) + 0.5) * step)
    points = np.dstack([x, y, np.zeros_like(x)]).astype(np.float32)
    normals = np.broadcast_to(np.float32([0, 0, 1]), points.shape)
    right, low = cols * step, -rows * step
    corners = np.array([[0, 0, 0], [right, 0, 0], [right, low, 0], [0, low, 0]], float)
    faces = np.array([[0, 2, 1], [0, 3, 2]])
    return Relief(points, normals, LIGHT_DPI, corners, faces, np.eye(3), np.zeros(3))


def without_light(image, mask, dpi, relief):
    """The result of a page whose light is found on cells averaged from it."""
    size = relief.inside.shape[::-1]
    cells = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    on_page = cv2.resize(mask.astype(np.float32), size, interpolation=cv2.INTER_AREA) > 0.999
    return find_light(cells, on_page, relief).removed_from(image, mask, dpi)


def evened_of(image, mask=None, dpi=DPI):
    return without_light(image, everywhere(image) if mask is None else mask, dpi, flat(image.shape, dpi)).image


@pytest.mark.parametrize("dpi", [DPI, 200.0])
def test_a_page_in_falling_light_comes_back_even(dpi):
    reflectance, bare = page(dpi)
    image = lit(reflectance, lamp(reflectance.shape))
    evened = evened_of(image, dpi=dpi).astype(float)
    assert np.ptp(image[bare][:, 0].astype(float)) > 90  # what the light had done
    assert np.abs(evened - np.median(evened[bare]))[bare].max() < WORST
    ink = (evened[~bare] - np.median(evened[~bare], axis=0)).mean(axis=1)
    assert np.percentile(np.abs(ink), 99) < EVEN


def test_a_page_in_even_light_stays_as_it_is():
    reflectance, _ = page()
    image = lit(reflectance, np.full(reflectance.shape[:2], 0.9))
    change = np.abs(evened_of(image).astype(float) - image)
    assert change.max() <= ROUNDED


def test_coloured_paper_keeps_its_colour():
    """What tinted it, its maker or its lamp, nobody can tell from the picture; that it varies is the light's doing."""
    paper = np.array([200.0, 180.0, 120.0])
    light = lamp((300, 400))
    image = np.clip(paper * light[..., None] + 0.5, 0, 255).astype(np.uint8)
    evened = evened_of(image).astype(float).reshape(-1, 3)
    np.testing.assert_allclose(evened / evened[:, :1], np.tile(paper / paper[0], (len(evened), 1)), rtol=4 * TINT)
    assert np.ptp(evened[:, 0]) <= WORST


@pytest.mark.parametrize("side_mm", [15.0, 30.0, 60.0])
def test_a_figure_is_not_mistaken_for_a_shadow(side_mm):
    """Solid ink: the light is carried across it from the paper round it."""
    reflectance, _ = page()
    figure = np.zeros(reflectance.shape[:2], bool)
    side = round(side_mm / MM_PER_INCH * DPI)
    figure[200 : 200 + side, 300 : 300 + side] = True
    reflectance[figure] = INK
    light = lamp(reflectance.shape)
    image = lit(reflectance, light)
    evened = evened_of(image).astype(float)
    inner = evened[figure]
    assert np.abs(inner - np.median(inner, axis=0)).max() < WORST
    white = np.percentile(evened[~figure].max(axis=1), 90)
    assert np.abs(inner.mean(axis=0) - INK * white / PAPER).max() < WORST


def test_a_gradient_within_a_figure_is_kept():
    """A picture that fades from dark to light is no shadow, though a shadow fades like that."""
    reflectance, _ = page()
    fade = np.linspace(40, 200, 300)
    reflectance[150:350, 200:500] = fade[None, :, None]
    image = lit(reflectance, np.full(reflectance.shape[:2], 0.95))
    row = evened_of(image).astype(float)[250, 200:500, 0]
    assert np.abs(row - image[250, 200:500, 0]).max() < WORST


def test_no_gain_is_so_high_that_only_noise_would_be_left():
    image = np.full((400, 600, 3), 200, np.uint8)
    image[:, 300:] = DEEP
    assert LINEAR[evened_of(image)[:, 450:]].mean() < ROUNDING * MAX_GAIN * LINEAR[DEEP]


def test_outside_the_mask_nothing_changes_and_inside_nothing_leaks_in():
    reflectance, _ = page()
    image = lit(reflectance, lamp(reflectance.shape))
    mask = everywhere(image)
    mask[:, :60] = mask[:80] = False
    outside = image.copy()
    outside[~mask] = 255
    evened = evened_of(outside, mask)
    np.testing.assert_array_equal(evened[~mask], 255)
    black = np.where(mask[..., None], image, 0).astype(np.uint8)
    np.testing.assert_array_equal(evened_of(black, mask)[mask], evened[mask])


@pytest.mark.parametrize("shape", [(2, 40), (300, 2), (4, 4)])
def test_scraps_and_an_empty_mask_come_back(shape):
    image = np.full((*shape, 3), 120, np.uint8)
    nowhere = np.zeros(shape, bool)
    np.testing.assert_array_equal(evened_of(image, nowhere), image)
    assert evened_of(image).shape == image.shape


def test_compiled_and_plain_python_agree():
    rng = np.random.default_rng(3)
    image = rng.integers(0, 256, (9, 13, 3), dtype=np.uint8)
    gain = rng.uniform(0.5, 2.0, (4, 6, 3)).astype(np.float32)
    mask = rng.random((9, 13)) > 0.2
    compiled, plain = np.zeros_like(image[2:]), np.zeros_like(image[2:])
    for apply, out in ((module._multiply, compiled), (module._multiply.py_func, plain)):
        apply(image, mask, gain, 0.45, LINEAR, srgb_codes(np.arange(module.CODES) / (module.CODES - 1)), 2, out)
    np.testing.assert_array_equal(compiled, plain)


def test_a_pale_spot_in_a_figure_is_not_mistaken_for_paper():
    """Cream on dark blue: no paper is near, and what is pale must not tint the light on the rest of the figure."""
    reflectance, _ = page()
    rows, cols = np.indices(reflectance.shape[:2])
    figure = (np.abs(rows - 256) < 150) & (np.abs(cols - 350) < 200)
    spot = np.hypot(rows - 256, cols - 350) < 30
    reflectance[figure] = (60, 80, 160)
    reflectance[spot] = (232, 222, 185)
    image = lit(reflectance, np.full(reflectance.shape[:2], 0.95))
    change = np.abs(evened_of(image).astype(float) - image)
    assert change[figure].max() < EVEN


def curled(shape, dpi=DPI):
    """The relief of a page that rises to both sides, 60 mm round its middle line."""
    level = flat(shape, dpi)
    x = level.points[..., 0]
    slope = (x - x.mean()) / 150.0
    normals = np.dstack([-slope, np.zeros_like(x), np.ones_like(x)])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    height = (x - x.mean()) ** 2 / 300.0
    points = np.dstack([x, level.points[..., 1], height]).astype(np.float32)
    step = 8
    corners = points[::step, ::step].reshape(-1, 3).astype(float)
    rows, cols = points[::step, ::step].shape[:2]
    k = np.arange(rows * cols).reshape(rows, cols)
    a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[:-1, 1:], k[1:, :-1], k[1:, 1:]))
    faces = np.concatenate([np.stack([a, c, d], 1), np.stack([a, d, b], 1)])
    return Relief(points, normals.astype(np.float32), LIGHT_DPI, corners, faces, np.eye(3), np.zeros(3))


def from_the_left(relief, shape):
    """Light of a far lamp at 45° on the left, and of the room, pixel by pixel."""
    lamp = relief.normals @ np.float32([-0.7, 0.0, 0.7])
    return cv2.resize(0.4 + 0.6 * lamp, shape[1::-1], interpolation=cv2.INTER_LINEAR)


def photographed(reflectance, light):
    """Codes of a page of codes (h, w, 3) in some light, as a camera of 8 bits takes it."""
    linear = LINEAR[np.clip(reflectance, 0, 255).astype(np.uint8)] * light[..., None]
    noise = np.random.default_rng(5).normal(0, 1.0, linear.shape)
    return np.clip(srgb(linear) + noise + 0.5, 0, 255).astype(np.uint8)


def unevenness(image, where, reflectance):
    """Spread of what is left of the light where one print is: its relative standard deviation."""
    ratio = LINEAR[image[where]].sum(axis=1) / LINEAR[reflectance[where].astype(np.uint8)].sum(axis=1)
    return ratio.std() / ratio.mean()


def test_on_a_dark_page_the_light_is_found_on_its_ground():
    reflectance, ground = page()
    reflectance[ground], reflectance[~ground] = (30, 36, 82), (215, 210, 190)
    relief = curled(reflectance.shape)
    image = photographed(reflectance, from_the_left(relief, reflectance.shape))
    result = without_light(image, everywhere(image), DPI, relief)
    assert result.report["removed"]
    calm = (cv2.GaussianBlur(picture, (0, 0), BLUR) for picture in (image, result.image))
    bare = cv2.erode(ground.astype(np.uint8), np.ones((6 * BLUR + 1, 6 * BLUR + 1), np.uint8)) > 0
    before, after = (unevenness(picture, bare, reflectance) for picture in calm)
    assert after < before / 3
    text = LINEAR[result.image[~ground]].mean() / LINEAR[result.image[ground]].mean()
    true = LINEAR[reflectance[~ground].astype(np.uint8)].mean() / LINEAR[reflectance[ground].astype(np.uint8)].mean()
    assert text == pytest.approx(true, rel=CONTRAST)


def test_pale_tints_on_one_slope_do_not_colour_the_light():
    """All that faces the lamp is pale pink, all that turns away pale green, as if two lamps were of these colours."""
    reflectance, ground = page()
    half = reflectance.shape[1] // 2
    left, right = np.zeros_like(ground), np.zeros_like(ground)
    left[40:-40, 40 : half - 20], right[40:-40, half + 20 : -40] = True, True
    reflectance[left & ground], reflectance[right & ground] = (232, 218, 218), (218, 232, 220)
    relief = curled(reflectance.shape)
    image = photographed(reflectance, from_the_left(relief, reflectance.shape))
    result = without_light(image, everywhere(image), DPI, relief)
    assert result.report["removed"]
    for field in (left & ground, right & ground):
        hue, true = (LINEAR[picture[field].astype(np.uint8)].mean(axis=0) for picture in (result.image, reflectance))
        np.testing.assert_allclose(hue / hue.sum(), true / true.sum(), rtol=TINT)


def test_a_page_without_a_region_of_constant_print_is_returned_unchanged_with_the_reason():
    rng = np.random.default_rng(8)
    clouds = cv2.resize(rng.uniform(20, 230, (26, 36, 3)), (709, 512), interpolation=cv2.INTER_CUBIC)
    image = np.clip(clouds + rng.normal(0, 12, clouds.shape), 0, 255).astype(np.uint8)
    result = without_light(image, everywhere(image), DPI, curled(image.shape))
    np.testing.assert_array_equal(result.image, image)
    assert not result.report["removed"]
    assert result.report["reason"]
