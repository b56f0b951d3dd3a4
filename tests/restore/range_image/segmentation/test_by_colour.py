"""A table is told by its colour, and what is known of the paper on it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from restore.range_image.segmentation.by_colour import lab_colours, table_by_colour
from restore.range_image.segmentation.plane import TablePlane

PAPER, DARK, BEECH = (232, 228, 218), (62, 58, 55), (196, 158, 116)
TOLERANCE, PITCH = 0.2, 0.5  # mm
NOISE_CODES = 3.0


@pytest.fixture
def page(camera):
    area = np.zeros(camera.shape, bool)
    area[35:125, 40:160] = True
    return area


def found(camera, page, paper, table, height_mm=0.0):
    random = np.random.default_rng(1)
    colours = np.where(page[..., None], paper, table) + random.normal(0.0, NOISE_CODES, (*camera.shape, 3))
    colour = lab_colours(camera.shot(camera.plane(), np.clip(colours, 0, 255).astype(np.uint8)))
    band = np.ones(camera.shape, bool)
    band[12:-12, 12:-12] = False
    return table_by_colour(colour, TablePlane(np.broadcast_to(height_mm, camera.shape), TOLERANCE, PITCH), band, band)


@pytest.mark.parametrize(
    ("paper", "table", "brighter"), [(PAPER, DARK, True), (PAPER, BEECH, True), (DARK, PAPER, False)]
)
@pytest.mark.parametrize("height_mm", [0.0, 5.0])
def test_the_table_is_all_that_has_its_colour(camera, page, paper, table, brighter, height_mm):
    coloured = found(camera, page, paper, table, np.where(page, height_mm, 0.0))
    assert coloured.brighter == brighter
    assert coloured.plane.tolerance == TOLERANCE
    assert coloured.samples[~page].mean() > 0.98  # 1 % of a normal colour cloud lies outside
    assert coloured.samples[page].mean() < 0.005  # along the edge, where colours mix


@pytest.mark.parametrize("rms_mm", [0.1, 0.4])
def test_cloth_in_wrinkles_is_a_table(camera, page, rms_mm):
    """Higher than noise explains; ink of its colour on a page above them is not."""
    wrinkles = gaussian_filter(np.random.default_rng(8).normal(size=camera.shape), 12.0)
    wrinkles *= rms_mm / wrinkles.std()
    ink = page.copy()
    ink[:60] = False
    coloured = found(camera, page & ~ink, PAPER, DARK, np.where(page, 3.0, wrinkles))
    assert coloured.samples[~page].mean() > 0.95
    assert not coloured.samples[ink].any()


def test_a_table_that_is_bowed_by_more_than_its_border_shows_is_found_whole(camera, page):
    """By twice the tolerance; ink of its colour on a page is not of it."""
    across = np.linspace(-1.0, 1.0, camera.shape[1])
    bowed = np.broadcast_to(2.0 * TOLERANCE * (1.0 - across**2), camera.shape)
    noise = np.random.default_rng(4).normal(0.0, TOLERANCE / 4.0, camera.shape)
    ink = page.copy()
    ink[:60] = False
    coloured = found(camera, page & ~ink, PAPER, DARK, np.where(page, 5.0, bowed) + noise)
    assert coloured.samples[~page].mean() > 0.98
    assert not coloured.samples[ink].any()


def test_the_plane_of_an_even_table_is_left_as_it_is(camera, page):
    noise = np.random.default_rng(4).normal(0.0, TOLERANCE / 4.0, camera.shape)
    height = np.where(page, 5.0, 0.0) + noise
    assert np.array_equal(found(camera, page, PAPER, DARK, height).plane.height, height)


def test_paper_of_the_tables_colour_is_not_distinguished(camera, page):
    assert found(camera, page, PAPER, PAPER) is None


def test_letters_are_not_a_sheet(camera, page):
    lines = page & (camera.indices[0] % 8 < 2)
    assert found(camera, lines, DARK, PAPER) is None


def test_a_scan_without_colour_has_none(camera):
    assert lab_colours(replace(camera.shot(camera.plane()), texture=None)) is None
