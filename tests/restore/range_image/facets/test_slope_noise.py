"""The scatter of slopes, told by noisy facets, and what it adds to the ways along them."""

import numpy as np
import pytest

from restore.range_image.facets.facet_model import WIDE_RADIUS, Facets, fit_facets, in_whole_windows
from restore.range_image.facets.sheet import make_sheet
from restore.range_image.facets.slope_statistics import slope_variances

SEED = 5
APART = 2 * WIDE_RADIUS + 1  # samples from a window to the next that has no sample of it
NOISE_MM = 0.1
SPREAD = 0.25  # of the variance: a page of 160 × 200 samples has 600 separate windows, and the mean of the squares of a
# third as many is off by 0.1 at one standard deviation
NORMAL = 0.05  # of the variance of slopes that scatter each by itself: 7,000 squares, 0.017 at one standard deviation
BENT = 1e-3  # of that variance: what the bend of a cylinder of 60 mm puts into a third difference
LEFT = 0.3  # of what noise adds to ways: as TOLD, and what is left of the ways’ own scatter


@pytest.fixture(scope="module")
def noisy(camera):
    """A cylinder of 60 mm and its facets, from samples with noise; and the true slopes."""
    depth = 1.0 / camera.cylinder(60.0)
    samples = 1.0 / (depth + np.random.default_rng(SEED).normal(0.0, NOISE_MM, depth.shape))
    inside = np.ones(depth.shape, bool)
    return inside, fit_facets(samples, inside, inside, camera.rays.dx), camera.facets(1.0 / depth)


def variances(facets, inside):
    return slope_variances(facets.slope, in_whole_windows(inside & ~facets.crease))


def inner(values):
    return values[3 * APART : -3 * APART, 3 * APART : -3 * APART]


def test_the_scatter_is_that_of_the_slopes(noisy):
    inside, facets, true = noisy
    found = variances(facets, inside)
    for k in (0, 1):
        error = inner(facets.slope[..., k] - true[..., k + 1])
        assert inner(found[..., k]).mean() == pytest.approx(np.mean(error**2), rel=SPREAD)


def test_leaving_the_largest_squares_out_does_not_make_the_scatter_smaller(camera):
    slope = np.random.default_rng(SEED).normal(0.0, 2.0, (*camera.shape, 2))
    found = inner(slope_variances(slope, np.ones(camera.shape, bool)))
    np.testing.assert_allclose(found.mean(axis=(0, 1)), 4.0, rtol=NORMAL)


def test_a_bend_is_not_scatter(camera, noisy):
    inside, facets, true = noisy
    still = Facets(true[..., 0], true[..., 1:], np.zeros(inside.shape, bool), facets.noise)
    assert inner(variances(still, inside)).mean() < BENT * inner(variances(facets, inside)).mean()


def test_more_scatter_next_to_print_is_found_there(noisy):
    inside, facets, true = noisy
    wilder = np.zeros(inside.shape)
    wilder[:, :100] = 1.0
    error = facets.slope - true[..., 1:]
    facets = Facets(true[..., 0], true[..., 1:] + (1.0 + wilder[..., None]) * error, facets.crease, facets.noise)
    found = variances(facets, inside)
    assert found[:, :40].mean() > 2.0 * found[:, 160:].mean()


def test_creases_are_not_scatter(noisy):
    inside, facets, _ = noisy
    crease = np.zeros(inside.shape, bool)
    crease[:, 100] = True
    slope = facets.slope.copy()
    slope[:, 100:, 0] += 1e3 * np.sqrt(variances(facets, inside)[..., 0].max())
    folded = variances(Facets(facets.value, slope, crease, facets.noise), inside)
    assert folded.mean() == pytest.approx(variances(facets, inside).mean(), rel=SPREAD)


def test_a_page_too_narrow_for_an_estimate_has_none(camera):
    inside = np.ones((12, 15), bool)
    facets = Facets(np.full(inside.shape, 1e-3), np.zeros((*inside.shape, 2)), ~inside, 1e-9)
    np.testing.assert_array_equal(variances(facets, inside), 0.0)


@pytest.mark.parametrize("seed", range(3))
def test_ways_over_noisy_facets_are_as_long_as_without_noise_in_the_mean(camera, seed):
    depth = 1.0 / camera.plane((0.3, -0.2, 1.0))
    samples = 1.0 / (depth + np.random.default_rng(seed).normal(0.0, NOISE_MM, depth.shape))
    inside = np.ones(depth.shape, bool)
    rows, cols = (axis.ravel() for axis in np.meshgrid(np.arange(25, 130, 5), np.arange(25, 170, 5), indexing="ij"))
    starts = np.stack([rows, cols], axis=1).astype(float)
    nodes = np.concatenate([starts, starts + [0.0, 4.0], starts + [4.0, 0.0]])
    count = np.arange(len(starts))
    edges = np.concatenate([np.stack([count, count + k * len(starts)], axis=1) for k in (1, 2)])
    true = camera.sheet(camera.facets(1.0 / depth)).lengths(nodes, edges)
    facets = fit_facets(samples, inside, inside, camera.rays.dx)
    sheet = make_sheet(camera.rays, facets, inside, inside, np.zeros((*depth.shape, 2)), camera.shot(samples))
    plain = camera.sheet(sheet.planes).lengths(nodes, edges)  # as if nothing scattered
    grown, left = plain.sum() / true.sum() - 1.0, sheet.lengths(nodes, edges).sum() / true.sum() - 1.0
    assert grown > 0
    assert abs(left) < LEFT * grown + 5e-6
