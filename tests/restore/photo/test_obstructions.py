"""What covers the page in a photograph is found by print, colour and level; another light covers nothing."""

from math import ceil

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from restore.photo.coarse import COARSE_MM
from restore.photo.obstructions import MARGIN_MM, REACH_MM, RIM_MM, WHOLE_MM, WINDOW_MM, covered_mask

SHAPE = (150, 200)  # of a coarse page: 127 × 170 mm
SKIN, BLACK, PAPER = (0.5, 0.31, 0.22), (0.03, 0.03, 0.03), (0.8, 0.8, 0.78)
NOISE = 0.01  # of white, of a coarse pixel
# Blank paper near what covers the page is left out with it; of print only what the window of comparison spans.
BEYOND_MM = REACH_MM + 3 * WINDOW_MM + MARGIN_MM
PRINT_BEYOND_MM = 3 * WINDOW_MM + WHOLE_MM + MARGIN_MM
RIM_LEFT_MM = 1.0
MARGIN = ceil(MARGIN_MM / COARSE_MM)  # pixels of print that are left out with the blank paper beside it
FLAT = np.zeros((*SHAPE, 3)) + [0.0, 0.0, 1.0]


def printed(seed=0, lines=range(15, 100, 5)):
    """Linear light (h, w, 3) of lines of words on a page, its lower third and its margins blank."""
    rng = np.random.default_rng(seed)
    page = np.ones((*SHAPE, 3)) * PAPER
    for row in lines:
        page[row : row + 2, 15:185] *= rng.choice([0.35, 0.6, 1.0], 170)[None, :, None]
    return page


def photographed(page, gain=(1.0, 1.0, 1.0), seed=1):
    return page * gain + np.random.default_rng(seed).normal(0, NOISE, page.shape)


def found_in(photograph, page, shown, known, slopes=None):
    return covered_mask(photograph, page, FLAT if slopes is None else slopes, shown, known)


def everywhere():
    return np.ones(SHAPE, bool)


def disc(middle, radius):
    y, x = np.indices(SHAPE)
    return np.hypot(y - middle[0], x - middle[1]) < radius


def assert_found(found, hidden):
    inside = cv2.distanceTransform(hidden.astype(np.uint8), cv2.DIST_L2, 5) * COARSE_MM
    outside = cv2.distanceTransform((~hidden).astype(np.uint8), cv2.DIST_L2, 5) * COARSE_MM
    assert inside[hidden & ~found].max(initial=0.0) <= RIM_LEFT_MM
    assert outside[found].max(initial=0.0) <= BEYOND_MM
    amid_print = np.zeros(SHAPE, bool)
    amid_print[15 + MARGIN : 97 - MARGIN, 15 + MARGIN : 185 - MARGIN] = True
    assert outside[found & amid_print].max(initial=0.0) <= PRINT_BEYOND_MM


@settings(max_examples=15, deadline=None)
@given(
    tilt=st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4)),
    warm=st.floats(0.7, 1.4),
    bow=st.floats(-0.2, 0.2),
    seed=st.integers(0, 99),
)
def test_another_light_covers_nothing(tilt, warm, bow, seed):
    y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in SHAPE), indexing="ij")
    gain = np.exp(tilt[0] * x + tilt[1] * y + bow * x * y)[..., None] * [warm, 1.0, 1 / warm]
    page = printed(seed)
    found = found_in(photographed(page, gain, seed), photographed(page, seed=seed + 1), everywhere(), everywhere())
    assert not found.any()


def test_facets_that_a_lamp_lights_differently_cover_nothing():
    y, x = np.indices(SHAPE)
    slope = 0.6 * np.where((x // 25 + y // 30) % 2, 1.0, -1.0)
    normals = np.stack([slope, np.zeros(SHAPE), np.sqrt(1 - slope**2)], axis=-1)
    lit = (0.2 + 0.8 * (normals @ [0.6, 0.0, 0.8]))[..., None]
    assert not found_in(photographed(printed(), lit), printed(), everywhere(), everywhere(), normals).any()
    assert found_in(photographed(printed(), lit), printed(), everywhere(), everywhere()).any()  # as on a flat page


def test_a_place_with_normals_unlike_all_others_is_lit_as_the_page_is():
    """Ripples are lit by their slopes of 0.05; what follows from them for a slope of 0.6 is not a light of the page."""
    ripples = np.broadcast_to(np.cos(np.linspace(0, 6 * np.pi, SHAPE[1])), SHAPE)
    across = 0.05 * ripples
    across[20:26, 97:100], across[20:26, 100:103] = 0.6, -0.6
    normals = np.dstack([np.zeros(SHAPE), across, np.sqrt(1 - across**2)])
    seen = photographed(printed(), np.exp(0.5 * ripples)[..., None])
    assert not found_in(seen, printed(), everywhere(), everywhere(), normals).any()


def test_a_soft_shadow_covers_nothing():
    shadow = 1 - 0.5 * cv2.GaussianBlur(disc((70, 100), 40).astype(float), (0, 0), 12)[..., None]
    assert not found_in(photographed(printed(), shadow), printed(), everywhere(), everywhere()).any()


def test_print_that_is_not_resolved_contradicts_nothing_and_what_covers_it_is_found_by_its_colour():
    flat, hidden = np.zeros(SHAPE, bool), disc((55, 90), 18)
    flat[:, 60:120] = True
    run_together = cv2.GaussianBlur(printed(), (0, 0), 4.0)
    seen = photographed(np.where(flat[..., None], run_together, printed()))
    assert found_in(seen, printed(), everywhere(), everywhere()).any()
    assert not covered_mask(seen, printed(), FLAT, everywhere(), everywhere(), ~flat).any()
    found = covered_mask(np.where(hidden[..., None], SKIN, seen), printed(), FLAT, everywhere(), everywhere(), ~flat)
    inside = cv2.distanceTransform(hidden.astype(np.uint8), cv2.DIST_L2, 5) * COARSE_MM
    assert inside[hidden & ~found].max(initial=0.0) <= RIM_LEFT_MM


@pytest.mark.parametrize("colour", [SKIN, BLACK, (0.05, 0.1, 0.4)])
@pytest.mark.parametrize("middle", [(55, 90), (125, 100), (100, 150)])
def test_what_is_unlike_paper_is_found_over_print_and_over_blank_paper(colour, middle):
    hidden = disc(middle, 18)
    seen = np.where(hidden[..., None], colour, printed())
    assert_found(found_in(photographed(seen), printed(), everywhere(), everywhere()), hidden)


def test_another_page_is_found_where_it_hides_print_or_shows_its_own():
    hidden = np.zeros(SHAPE, bool)
    hidden[40:90, 60:140] = True
    seen = np.where(hidden[..., None], np.roll(printed(seed=7), (3, 2), axis=(0, 1)), printed())
    assert_found(found_in(photographed(seen), printed(), everywhere(), everywhere()), hidden)


def test_a_haze_that_leaves_no_contrast_is_found():
    hidden = disc((55, 90), 18)
    seen = printed() + 4.0 * hidden[..., None]
    assert_found(found_in(photographed(seen), printed(), everywhere(), everywhere()), hidden)


def test_white_paper_that_is_clipped_hides_the_page_as_far_as_it_reaches():
    """A sheet over print, clipped in its middle; its far end is blank and lies on a blank place amid print."""
    page, hidden, clipped = printed(lines=range(15, 145, 5)), np.zeros(SHAPE, bool), np.zeros(SHAPE, bool)
    hidden[60:135, 60:140], clipped[90:122, 60:140] = True, True
    page[95:136, 60:140] = PAPER
    sheet = np.ones((*SHAPE, 3)) * PAPER
    sheet[62:88:3, 65:135] *= 0.4
    seen = np.where(hidden[..., None], sheet, page)
    found = covered_mask(photographed(seen), page, FLAT, everywhere(), everywhere(), glare=clipped)
    inside = cv2.distanceTransform(hidden.astype(np.uint8), cv2.DIST_L2, 5) * COARSE_MM
    assert inside[hidden & ~found].max(initial=0.0) <= WINDOW_MM  # print beside it confirms so much blank paper


def test_a_mirrored_lamp_covers_nothing_but_its_own_glare():
    clipped = disc((120, 100), 12)
    found = covered_mask(photographed(printed()), printed(), FLAT, everywhere(), everywhere(), glare=clipped)
    np.testing.assert_array_equal(found, clipped)


def test_a_grey_thing_over_blank_paper_is_covered_within_its_outline():
    """Its inside alone is paper in a shadow; its dark outline contradicts the page, and nothing inside confirms it."""
    hidden, outline = disc((122, 100), 20), disc((122, 100), 20) & ~disc((122, 100), 17)
    seen = np.where(hidden[..., None], printed() * 0.6, printed())
    seen[outline] *= 0.25
    assert_found(found_in(photographed(seen), printed(), everywhere(), everywhere()), hidden)


def test_a_fleck_of_less_than_a_millimetre_is_not_a_cover():
    seen = printed()
    seen[120, 100] *= 0.5
    assert not found_in(photographed(seen), printed(), everywhere(), everywhere()).any()


def test_a_crease_that_is_displaced_by_two_cells_covers_nothing():
    """Blank paper, one leaf a third darker than the other; the step is two cells farther in the photograph."""
    x = np.indices(SHAPE)[1]
    page, seen = (np.ones((*SHAPE, 3)) * PAPER * np.where(x < at, 1.0, 0.67)[..., None] for at in (100, 102))
    assert not found_in(photographed(seen), page, everywhere(), everywhere()).any()


def test_where_the_scanner_saw_nothing_the_nearest_place_that_it_saw_decides():
    hidden = disc((55, 60), 20)
    seen = np.where(hidden[..., None], SKIN, printed())
    known = everywhere()
    known[:, 55:62] = False  # a strip behind a fold
    assert_found(found_in(photographed(seen), printed(), everywhere(), known), hidden)


def test_nothing_is_said_of_places_that_the_photograph_does_not_show():
    hidden, seen_there = disc((55, 90), 20), everywhere()
    seen_there[:, :80] = False
    seen = np.where(hidden[..., None], SKIN, printed())
    assert not found_in(photographed(seen), printed(), seen_there, everywhere())[:, :80].any()


def test_a_strip_narrower_than_its_rims_cannot_be_compared():
    narrow = np.zeros(SHAPE, bool)
    narrow[50 : 50 + int(2 * RIM_MM / COARSE_MM)] = True
    assert not found_in(photographed(printed(), (0.1, 0.1, 0.1)), printed(), narrow, everywhere()).any()
