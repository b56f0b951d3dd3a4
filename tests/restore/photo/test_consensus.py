"""What most photographs show is the page, whatever lies on it in one of them."""

import numpy as np
import pytest

from restore.photo.coarse import CoarseView
from restore.photo.consensus import consensus
from restore.photo.obstructions import covered_mask

SHAPE = (120, 160)  # of a coarse page: 102 × 136 mm
SKIN = (0.5, 0.31, 0.22)
NOISE = 0.01  # of white, of a coarse pixel
FLAT = np.zeros((*SHAPE, 3)) + [0.0, 0.0, 1.0]
LIGHTS = ((1.0, 0.2), (0.8, -0.2), (1.3, 0.1), (0.9, 0.3), (1.1, -0.3))  # of the views: gain, and its slope
HIDDEN = np.hypot(*(np.indices(SHAPE).T - [55, 80]).T) < 15


def printed():
    rng = np.random.default_rng(0)
    page = np.full((*SHAPE, 3), 0.8)
    for row in range(12, 108, 5):
        page[row : row + 2, 12:148] *= rng.choice([0.35, 0.6, 1.0], 136)[None, :, None]
    return page


def in_light(page, gain, slope):
    return page * gain * np.exp(slope * np.linspace(-1, 1, SHAPE[1]))[:, None]


def view(light, good=None, resolved=None):
    everywhere, none = np.ones(SHAPE, bool), np.zeros(SHAPE, bool)
    good, resolved = (everywhere if mask is None else mask for mask in (good, resolved))
    return CoarseView(good, np.ones(SHAPE), light, none, resolved)


def views(number=5):
    """Views of the page, each in a light; something lies on the page in the first."""
    rng = np.random.default_rng(1)
    lights = [in_light(printed(), *light) + rng.normal(0, NOISE, (*SHAPE, 3)) for light in LIGHTS[:number]]
    lights[0] = np.where(HIDDEN[..., None], SKIN, lights[0])
    return [view(light) for light in lights]


@pytest.mark.parametrize("textured_from", [0, 1])
@pytest.mark.parametrize("number", [3, 5])
def test_what_lies_on_the_page_in_one_photograph_is_found_there_and_nowhere_else(textured_from, number):
    """Whichever of the photographs stands for the scan."""
    shown = views(number)
    usual = consensus(shown, shown[textured_from], FLAT)
    covered = [covered_mask(one.light, usual.light, FLAT, one.good, usual.good) for one in shown]
    assert covered[0][HIDDEN].all()
    assert not np.any(covered[1:])


def test_it_is_the_page_in_the_light_of_the_scan():
    """But for the noise of a median of five, and what the cover adds to the fitted light."""
    shown = views()
    usual = consensus(shown, shown[0], FLAT)
    off = usual.light / in_light(printed(), *LIGHTS[0]) - 1
    assert np.sqrt((off**2).mean()) < 3 * NOISE
    assert abs(off[HIDDEN].mean()) < NOISE


def test_the_order_of_the_photographs_does_not_matter():
    shown = views()
    np.testing.assert_array_equal(consensus(shown, shown[0], FLAT).light, consensus(shown[::-1], shown[0], FLAT).light)


def test_where_fewer_than_three_photographs_show_the_page_the_scan_stands():
    shown, col = views(3), np.arange(SHAPE[1])
    few = (col >= 20) & (col < 60)
    scanned = view(shown[0].light, good=np.broadcast_to(col < 50, SHAPE))
    shown[2] = view(shown[2].light, good=np.broadcast_to(~few, SHAPE))
    usual = consensus(shown, scanned, FLAT)
    np.testing.assert_array_equal(usual.light[:, few], scanned.light[:, few])
    np.testing.assert_array_equal(usual.good, np.broadcast_to((col < 50) | ~few, SHAPE))
    assert consensus(shown[:2], scanned, FLAT) is scanned


def test_print_is_that_of_the_views_that_resolve_it_where_three_do():
    """Four views of five see the left half flat; four blank ones do not outvote three."""
    shown, left = views(), np.arange(SHAPE[1]) < 80
    flat = [view(np.where(left[:, None], 0.7, one.light), resolved=np.broadcast_to(~left, SHAPE)) for one in shown[1:]]
    usual = consensus([shown[0], *flat], shown[0], FLAT)
    np.testing.assert_array_equal(usual.resolved, np.broadcast_to(~left, SHAPE))
    run_together = [view(np.full((*SHAPE, 3), 0.7), resolved=np.zeros(SHAPE, bool))] * 4
    usual = consensus([*shown[1:4], *run_together], shown[1], FLAT)
    assert usual.resolved.all()
    off = usual.light / in_light(printed(), *LIGHTS[1]) - 1
    assert np.sqrt((off**2).mean()) < 3 * NOISE


def test_photographs_that_show_nothing_of_the_scan_do_not_count():
    shown, left = views(), np.arange(SHAPE[1]) < 60
    scanned = view(shown[0].light, good=np.broadcast_to(left, SHAPE))
    beyond = [view(one.light, good=np.broadcast_to(~left, SHAPE)) for one in shown]
    assert consensus(beyond, scanned, FLAT) is scanned
    np.testing.assert_array_equal(
        consensus([*shown, *beyond], scanned, FLAT).light, consensus(shown, scanned, FLAT).light
    )
