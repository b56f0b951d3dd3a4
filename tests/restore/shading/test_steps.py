"""Steps of the light are found and placed to a part of a cell by the ground beside them; nothing else is moved."""

import numpy as np
import pytest
from scipy.special import ndtr

from restore.numerics.srgb import LINEAR, srgb_codes
from restore.shading.divide import Division
from restore.shading.steps import DISPLACED, WIDTH, find_steps, place_steps

SHAPE = (160, 200)
DARK, BRIGHT = 0.5, 0.9
DISPLACEMENT, SPREAD = 0.8, 0.5  # cells
NOISE = 0.01
PLACED = 0.1  # cells: a third of the displacement's remainder once stairs of a cell are averaged over 25 of them
WAYS = [(1.0, 0.0), (0.0, 1.0), (0.8, 0.6), (-0.6, 0.8)]
PIXELS = 5  # of the page to a cell
CODE = 2.0  # codes: half of one in the page, and as much in the light
MOST = 8.0


def distance_from(way, shape=SHAPE, scale=1):
    """Cells (r, c) from a straight crease through the middle, positive to the side of `way`, (right, down)."""
    rows, cols = ((at + 0.5) / scale for at in np.indices(shape))
    return (cols - SHAPE[1] / 2) * way[0] + (rows - SHAPE[0] / 2) * way[1]


def step(distance):
    """Light (r, c) of a sharp step where the distance is 0."""
    return np.where(distance > 0, BRIGHT, DARK).astype(np.float32)


def drawn(distance):
    """Light (r, c) of that step as a camera draws it, displaced to its bright side."""
    return (DARK + (BRIGHT - DARK) * ndtr((distance - DISPLACEMENT) / SPREAD)).astype(np.float32)


def three(field):
    return np.repeat(field[..., None], 3, axis=2)


def everywhere():
    return np.ones(SHAPE, bool)


def seen(way, ink=0.0):
    """Three times the brightness (r, c) of bare paper with noise, a share of it covered by blots."""
    rng = np.random.default_rng(2)
    paper = 1 + NOISE * rng.standard_normal(SHAPE)
    blots = np.kron(rng.random((SHAPE[0] // 4, SHAPE[1] // 4)) < ink, np.ones((4, 4))) > 0
    return (3 * drawn(distance_from(way)) * np.where(blots, 0.3, paper)).astype(np.float32), ~blots


def inner(way, reach):
    rows, cols = np.indices(SHAPE)
    border = np.minimum.reduce([rows, cols, SHAPE[0] - 1 - rows, SHAPE[1] - 1 - cols]) > 20
    return border & (np.abs(distance_from(way)) < reach)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("ink", [0.0, 0.3])
def test_a_displaced_step_is_placed_by_the_paper_next_to_it_whatever_is_printed_there(way, ink):
    light = step(distance_from(way))
    steps = find_steps(three(light), everywhere())
    ratio, bare = seen(way, ink)
    found = place_steps(steps, ratio, bare & ~inner(way, 2))
    near = inner(way, 1)
    assert np.abs(found.shift[near] - DISPLACEMENT).mean() < PLACED
    assert np.abs(found.width[near] - SPREAD).mean() < PLACED
    truth = drawn(distance_from(way))
    before, after = (np.abs(one.sharp[..., 0] - truth)[inner(way, 3)].mean() for one in (steps, found))
    assert after < before / 4


def test_a_constant_gradient_has_no_step():
    light = np.broadcast_to(np.linspace(0.3, 1.0, SHAPE[1], dtype=np.float32), SHAPE)
    steps = find_steps(three(light), everywhere())
    assert not steps.found[:, 3:-3].any()  # at the border the light is known on one side only


@pytest.mark.parametrize("ground", [np.zeros(SHAPE, bool), distance_from(WAYS[0]) > 0], ids=["nowhere", "on one side"])
def test_without_ground_on_both_sides_a_step_stays_where_the_shape_has_it(ground):
    steps = find_steps(three(step(distance_from(WAYS[0]))), everywhere())
    found = place_steps(steps, seen(WAYS[0])[0], ground)
    np.testing.assert_array_equal(found.shift, 0)
    np.testing.assert_array_equal(found.width, np.float32(WIDTH))


def test_no_step_is_displaced_by_more_than_shape_and_picture_may_differ():
    far = step(distance_from(WAYS[0]) - 5 * DISPLACED)
    steps = find_steps(three(far), everywhere())
    found = place_steps(steps, seen(WAYS[0])[0], np.abs(distance_from(WAYS[0])) > 8)
    assert np.abs(found.shift).max() <= 2 * DISPLACED


@pytest.mark.parametrize("way", WAYS)
def test_a_page_of_more_pixels_than_cells_is_even_across_a_crease(way):
    ratio, bare = seen(way)
    steps = place_steps(find_steps(three(step(distance_from(way))), everywhere()), ratio, bare)
    fine = tuple(PIXELS * side for side in SHAPE)
    lit = drawn(distance_from(way, fine, PIXELS))
    image = three(np.asarray(srgb_codes(lit * 0.8)))
    page = Division(1 / steps.sharp, steps, MOST).divided(image, np.ones(fine, bool), 1 / PIXELS)
    paper = int(srgb_codes(np.array([0.8]))[0])
    middle = np.s_[fine[0] // 4 : -fine[0] // 4, fine[1] // 4 : -fine[1] // 4]
    assert np.abs(page[middle].astype(int) - paper).mean() < CODE
    assert np.ptp(LINEAR[page[middle]]) < np.ptp(lit) / 2
