"""The surface of a table from blocks of samples: flat or bowed, even or not, alone or with a page just above it."""

import numpy as np
import pytest

from restore.numerics.robust import SIGNIFICANT
from restore.range_image.segmentation.surface import (
    BLOCK,
    UNEVEN_MM,
    block_numbers,
    blocks_of,
    likeliest_surface,
    terms_of,
)

SHAPE = (160, 200)
NOISE_MM = 0.08
MAX_BOW_MM = 3.0
TILT = np.array([2.0, 0.03, -0.02, 0.0, 0.0, 0.0])  # mm, and mm for each sample
EXACT_MM = 1e-9  # of heights of some millimetres, to rounding
WITHIN_MM = 4.0 * NOISE_MM / BLOCK  # of a surface that hundreds of blocks tell, each to a quarter of that


@pytest.fixture
def band():
    area = np.ones(SHAPE, bool)
    area[12:-12, 12:-12] = False
    return area


@pytest.fixture
def terms():
    rows, cols = np.indices(SHAPE).astype(float)
    return terms_of(cols - 99.5, 79.5 - rows)


def bowed(terms, bow_mm, sign=1.0):
    """(rows, cols) mm: a saddle (sign −1) or a bowl that rises by a bow from the middle to the left and the right."""
    return terms @ np.array([0.0, 0.0, 0.0, 1.0, 0.0, sign]) * bow_mm / 99.5**2


def surface_of(heights, band, terms, noise=0.0):
    heights = heights + np.random.default_rng(1).normal(0.0, noise, SHAPE) if noise else heights
    blocks = blocks_of(block_numbers(band), terms[band], heights[band], noise, 1)
    return likeliest_surface(blocks, terms[::8, ::8].reshape(-1, 6), MAX_BOW_MM), blocks


def test_terms_are_those_of_a_quadratic():
    np.testing.assert_array_equal(terms_of(np.array([[2.0]]), np.array([[-3.0]])), [[[1.0, 2.0, -3.0, 4.0, -6.0, 9.0]]])


def test_a_block_has_the_mean_of_its_samples_and_less_noise(terms):
    """Samples of two blocks, 30 and 6; of them one in 4² has noise of its own, and of a block one at least."""
    band = np.zeros(SHAPE, bool)
    band[:5, :6] = band[6, 6:12] = True
    heights = np.arange(band.size, dtype=float).reshape(SHAPE)
    numbers = block_numbers(band)
    blocks = blocks_of(numbers, terms[band], heights[band], NOISE_MM, 1)
    np.testing.assert_allclose(blocks.heights, [heights[:5, :6].mean(), heights[6, 6:12].mean()])
    np.testing.assert_allclose(blocks.terms[1], terms[6, 6:12].mean(axis=0))
    np.testing.assert_allclose(blocks.noise, NOISE_MM / np.sqrt([30, 6]))
    np.testing.assert_allclose(blocks.weights, [30 / 18, 6 / 18])
    apart = blocks_of(numbers, terms[band], heights[band], NOISE_MM, 4)
    np.testing.assert_allclose(apart.noise, NOISE_MM / np.sqrt([30 / 16, 1]))


@pytest.mark.parametrize("bow_mm", [0.0, 0.7, -1.4])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_quadratic_surface_without_noise_is_found_exactly(band, terms, bow_mm, sign):
    heights = terms @ TILT + bowed(terms, bow_mm, sign)
    surface, blocks = surface_of(heights, band, terms)
    assert np.abs(terms @ surface.factors - heights).max() < EXACT_MM
    assert surface.uneven == UNEVEN_MM[0] / SIGNIFICANT
    assert surface.of(blocks).all()


def test_noise_alone_does_not_bow_a_surface(band, terms):
    surface, _ = surface_of(terms @ TILT, band, terms, NOISE_MM)
    assert not surface.factors[3:].any()
    assert np.abs(terms @ (surface.factors - TILT)).max() < WITHIN_MM


@pytest.mark.parametrize(("bow_mm", "above_mm"), [(0.0, 0.3), (0.0, 1.0), (0.7, 1.0)])
def test_a_page_just_above_a_table_does_not_tilt_its_surface(band, terms, bow_mm, above_mm):
    """The page is nearly half of the band, and four times the noise of a sample above the table, or more."""
    page = np.indices(SHAPE)[1] < 50
    heights = terms @ TILT + bowed(terms, bow_mm)
    surface, _ = surface_of(heights + above_mm * page, band, terms, NOISE_MM)
    assert np.abs(terms @ surface.factors - heights)[band & ~page].max() < WITHIN_MM


def test_the_blocks_of_a_table_show_how_uneven_it_is(band, terms):
    """In waves that no quadratic follows, of a fifth of a millimetre: a root of two less is their deviation."""
    waves = 0.2 * np.sin(2.0 * np.pi * np.indices(SHAPE)[1] / 50.0)
    surface, blocks = surface_of(terms @ TILT + waves, band, terms, NOISE_MM)
    assert surface.uneven == UNEVEN_MM[-1] / SIGNIFICANT
    assert surface.of(blocks).all()


def test_what_is_bent_by_more_than_a_table_is_not_followed(band, terms):
    surface, blocks = surface_of(bowed(terms, 2.0 * MAX_BOW_MM), band, terms)
    assert not surface.factors[3:].any()
    assert not surface.of(blocks).all()


@pytest.mark.parametrize("place", [np.s_[:BLOCK], np.s_[:, :BLOCK], np.s_[:1], np.s_[:BLOCK, :BLOCK]])
def test_blocks_on_a_line_have_no_surface(terms, place):
    band = np.zeros(SHAPE, bool)
    band[place] = True
    assert surface_of(terms @ TILT, band, terms)[0] is None


def test_a_few_blocks_determine_a_plane(terms):
    band = np.zeros(SHAPE, bool)
    band[:12, :18] = True
    surface, blocks = surface_of(terms @ TILT, band, terms)
    assert len(blocks.heights) == 6
    assert np.abs(terms @ surface.factors - terms @ TILT).max() < EXACT_MM
