"""Lines of light along creases are found between print; print itself, and figures that end at a crease, are not."""

import numpy as np
import pytest

from restore.shading import crease_residual as module
from restore.shading.crease_residual import crease_light

SHAPE = (160, 200)
LINE = 0.8  # of the paper on both sides
NOISE = 0.01
# The quantile of 25 places with 1 % of noise, and the half-cell by which a slanted line is read beside its middle.
FOUND = 0.03
OPEN_PLAIN = (np.ones(SHAPE, np.float32), np.ones(SHAPE, np.float32))  # openness and stretch of a level page
SLOPE_STRETCH = 2.3  # of the sides of a gutter, 64° steep
VALLEY = 10  # cells to either side: how far the page's own shadow reaches into such a gutter
SHADOW_LEFT = 0.5  # of the shadow: what lies on its flanks has sides in it, and is lightened less
CREASES = [(1.0, 0.0), (0.0, 1.0), (0.8, 0.6), (-0.6, 0.8)]


def crease(way):
    """Distance (r, c) in cells from a straight crease through the middle that runs across `way`, (right, down)."""
    rows, cols = np.indices(SHAPE)
    return (cols - SHAPE[1] / 2) * way[0] + (rows - SHAPE[0] / 2) * way[1]


def page(way):
    """The light expected at a crease, and bare paper with noise."""
    expected = np.where(crease(way) > 0, 1.0, 0.6).astype(np.float32)
    paper = 1 + NOISE * np.random.default_rng(1).standard_normal(SHAPE)
    return expected, paper.astype(np.float32)


def everywhere():
    return np.ones(SHAPE, bool)


def inner(distance, reach):
    """The middle of the page, within `reach` of a line."""
    rows, cols = np.indices(SHAPE)
    border = np.minimum.reduce([rows, cols, SHAPE[0] - 1 - rows, SHAPE[1] - 1 - cols]) > 30
    return border & (np.abs(distance) < reach)


@pytest.mark.parametrize("way", CREASES)
@pytest.mark.parametrize("line", [LINE, 1 / LINE])
def test_a_line_along_a_crease_is_found_under_print(way, line):
    expected, paper = page(way)
    distance = crease(way)
    paper[np.abs(distance) < 2] *= line
    rows, cols = np.indices(SHAPE)
    paper[(rows % 10 < 5) & (cols % 3 < 1)] *= 0.2  # lines of letters
    found = crease_light(paper, paper, expected, everywhere(), *OPEN_PLAIN)
    assert found[inner(distance, 1)].mean() == pytest.approx(line, abs=FOUND)
    assert np.abs(found[inner(distance, np.inf) & (np.abs(distance) > 8)] - 1).max() < FOUND


@pytest.mark.parametrize("way", CREASES)
def test_a_figure_that_ends_at_a_crease_keeps_its_edge(way):
    expected, paper = page(way)
    distance = crease(way)
    paper[distance > 0] *= 0.3
    found = crease_light(paper, paper, expected, everywhere(), *OPEN_PLAIN)
    assert np.abs(found[inner(distance, 9)] - 1).mean() < FOUND


def test_a_line_through_a_dark_figure_is_found_as_on_paper():
    expected, paper = page((1.0, 0.0))
    distance = crease((1.0, 0.0))
    paper[np.abs(distance) < 2] *= LINE
    figure = np.float32(0.1) * paper
    found = crease_light(figure, figure, expected, everywhere(), *OPEN_PLAIN)
    assert found[inner(distance, 1)].mean() == pytest.approx(LINE, abs=FOUND)


def test_where_the_light_changes_slowly_nothing_is_looked_for():
    rows, cols = np.indices(SHAPE)
    expected = (0.5 + 0.5 * cols / SHAPE[1]).astype(np.float32)
    printed = np.where(np.abs(rows - 80) < 2, 0.5, 1.0).astype(np.float32)
    np.testing.assert_array_equal(crease_light(printed, printed, expected, everywhere(), *OPEN_PLAIN), 1.0)


@pytest.mark.parametrize("darkest, brightest", [(0.1, 0.1), (0.1, 0.9), (3.0, 3.0), (1.0, 1.5)])
def test_what_light_cannot_do_is_print(darkest, brightest):
    """A black rule, a coloured one, the gap between two figures and one between coloured figures."""
    expected, paper = page((1.0, 0.0))
    rule = np.abs(crease((1.0, 0.0))) < 2
    channels = (np.where(rule, paper * np.float32(tone), paper) for tone in (darkest, brightest))
    found = crease_light(*channels, expected, everywhere(), *OPEN_PLAIN)
    assert np.abs(found - 1)[inner(rule, np.inf)].max() < FOUND


def gutter(way):
    """Openness and stretch (r, c) of a gutter that runs across `way`, and the light left in it."""
    distance = np.abs(crease(way))
    openness = np.clip(0.5 + 0.02 * distance, 0, 1).astype(np.float32)
    stretch = np.where(distance < 2 * VALLEY, SLOPE_STRETCH, 1).astype(np.float32)
    return openness, stretch, np.clip(0.6 + 0.4 * distance / VALLEY, 0, 1).astype(np.float32)


@pytest.mark.parametrize("way", CREASES)
def test_a_shadow_in_a_gutter_is_found_under_print_where_no_step_is_expected(way):
    _, paper = page(way)
    openness, stretch, light = gutter(way)
    rows, cols = np.indices(SHAPE)
    paper[(rows % 10 < 5) & (cols % 3 < 1)] *= 0.2  # lines of letters
    expected = np.ones(SHAPE, np.float32)
    left = light / crease_light(paper * light, paper * light, expected, everywhere(), openness, stretch)
    near = inner(crease(way), VALLEY)
    assert np.abs(left[near] - 1).mean() < SHADOW_LEFT * np.abs(light[near] - 1).mean()
    level = crease_light(paper * light, paper * light, expected, everywhere(), *OPEN_PLAIN)
    np.testing.assert_array_equal(level, 1.0)


def test_a_coloured_field_in_a_gutter_is_print():
    _, paper = page((1.0, 0.0))
    openness, stretch, _ = gutter((1.0, 0.0))
    field = np.abs(crease((1.0, 0.0))) < VALLEY
    channels = (np.where(field, paper * np.float32(tone), paper) for tone in (0.5, 0.9))
    found = crease_light(*channels, np.ones(SHAPE, np.float32), everywhere(), openness, stretch)
    assert np.abs(found - 1)[inner(field, np.inf)].max() < FOUND


def test_off_the_page_nothing_is_looked_at():
    expected, paper = page((1.0, 0.0))
    inside = everywhere()
    inside[:40] = False
    paper[~inside] = np.nan
    assert np.isfinite(crease_light(paper, paper, expected, inside, *OPEN_PLAIN)[inside]).all()


def test_compiled_and_plain_python_agree():
    rng = np.random.default_rng(3)
    brightness = rng.uniform(0.5, 1.5, (30, 34)).astype(np.float32)
    inside, near = rng.random((30, 34)) > 0.1, rng.random((30, 34)) > 0.3
    turn = rng.uniform(0, 2 * np.pi, (30, 34)).astype(np.float32)
    across = np.dstack([np.cos(turn), np.sin(turn)])
    results = []
    for bright_of, adjacent in (
        (module._bright, module._ratio_to_sides),
        (module._bright.py_func, module._ratio_to_sides.py_func),
    ):
        bright, out = np.full((20, 34), np.nan, np.float32), np.ones((20, 34), np.float32)
        bright_of(brightness, inside, across, near, 10, bright)
        adjacent(brightness, across, near, 10, out)
        results.append((bright, out))
    for compiled, plain in zip(*results, strict=True):
        np.testing.assert_allclose(compiled, plain, rtol=1e-6)
