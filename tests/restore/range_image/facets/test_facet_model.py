"""Facets reduce noise as far as least squares can, and keep creases sharp."""

import numpy as np
import pytest

from restore.errors import NotEnoughSurface
from restore.range_image.facets.creases import BORDER_MARGIN, HALF_LENGTH, HALF_WIDTH
from restore.range_image.facets.facet_model import WIDE_RADIUS, fit_facets
from restore.range_image.facets.quadratic_fit import POWERS, fit_quadratics

SAMPLING_ERROR = 0.03  # relative; 30,000 samples in overlapping windows are 600 windows that do not overlap
OUTLIERS = 0.02  # of the samples, on edges of ink
OUTLIER_LINES = 3.0
MAX_ERROR_RISE = 0.05  # relative rise of the error with one sample in fifty left out
ROUNDING = 1e-6  # standard deviations
MAX_TILT_ERROR = 0.05  # standard deviations: noise bends a corner by so much that it is fitted over its tangent plane
NEAR_RIDGE = 4  # samples: within a window's reach of the ridge
MAX_ERROR_NEAR = 3.0  # standard deviations: noise alone, in windows with the sample at their border
MAX_ONE_SIDED_ERROR = 0.6  # standard deviations for each sample: the slope at the border of a window, not at its centre
MAX_ERROR_RATIO = 0.65  # of the error that windows across the ridge leave; at 45° half of that is noise
MAX_ERROR = 5.0  # standard deviations of the best of 50,000 samples that are each right to half of one
SPINE_DEG, SPINE_REACH_MM = 66.0, 25.0  # slope of the walls at a spine, and the way in which it falls to 1/e
STEEP_DEG, NARROW_REACH_MM = 75.0, 10.0
NEAR_SPINE_MM = 6.0  # four samples
MAX_SPINE_ERROR = 0.02  # of the slope, in the mean; quadratics over the grid are 5 % too flat
MAX_SPARSE_SLOPE = 2.0  # standard deviations of the best for each sample: 0.035 mm at 0.9 m, 4° at 0.47 mm a sample
TABLE_SIGMAS = 80.0  # standard deviations that the table lies behind the border of the page: 2.8 mm at 0.9 m
MAX_BORDER_SLOPE = (
    10.0  # standard deviations for each sample: of three columns' noise; facets that pass the table have 80
)
FAINT_FOLD_DEG = 20.0  # half of its samples stand out as a crease, the others are smoothed over
MAX_FAINT_FOLD_ERROR = 4.0  # standard deviations, 0.14 mm at 0.9 m


@pytest.fixture
def noise(camera):
    return np.random.default_rng(0).normal(0.0, camera.noise, camera.shape)


@pytest.fixture
def everywhere(camera):
    return np.ones(camera.shape, bool)


def centre_noise(radius):
    """Standard deviation of a window's fitted value at its centre, and of its slope, for samples with deviation 1."""
    rows, cols = (part.ravel() for part in np.mgrid[-radius : radius + 1, -radius : radius + 1])
    design = np.stack([cols**p * rows**q for p, q in POWERS], axis=1)
    covariance = np.linalg.inv(design.T @ design)
    return np.sqrt(covariance[0, 0]), np.sqrt(covariance[1, 1])


def inner(camera, by=WIDE_RADIUS):
    mask = np.zeros(camera.shape, bool)
    mask[by:-by, by:-by] = True
    return mask


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("radius", [60.0, 100.0, 170.0, None])
def test_noise_is_reduced_as_least_squares_predicts_on_any_curl(camera, noise, everywhere, radius):
    exact = camera.plane((0.3, 0.2, 1.0)) if radius is None else camera.cylinder(radius)
    facets = fit_facets(exact + noise, everywhere, everywhere, camera.rays.dx)
    value, slope = centre_noise(WIDE_RADIUS)
    here = inner(camera)
    assert facets.noise == pytest.approx(camera.noise, rel=SAMPLING_ERROR)
    assert rms((facets.value - exact)[here]) == pytest.approx(value * camera.noise, rel=SAMPLING_ERROR)
    down, right = np.gradient(exact)
    errors = facets.slope - np.dstack([right, down])
    assert rms(errors[here]) == pytest.approx(slope * camera.noise, rel=SAMPLING_ERROR)
    assert not facets.crease.any()


def test_an_exact_quadratic_surface_is_reproduced_exactly(camera, everywhere):
    exact = camera.plane((0.3, 0.2, 1.0))
    facets = fit_facets(exact, everywhere, everywhere, camera.rays.dx)
    np.testing.assert_allclose(facets.value, exact, atol=ROUNDING * camera.noise)
    assert not facets.crease.any()


def test_a_curl_scanned_without_noise_has_no_creases_and_no_gaps(camera, everywhere):
    facets = fit_facets(camera.cylinder(60.0), everywhere, everywhere, camera.rays.dx)
    assert not facets.crease.any()
    assert np.isfinite(facets.value).all()


def test_a_tilt_of_the_whole_scan_only_tilts_the_facets(camera, noise, everywhere):
    data = camera.roof(90.0, 30.0, 100.3) + noise
    tilt = camera.plane((0.3, 0.2, 1.0)) - camera.plane()
    straight, tilted = (fit_facets(image, everywhere, everywhere, camera.rays.dx) for image in (data, data + tilt))
    np.testing.assert_array_equal(tilted.crease, straight.crease)
    off = np.abs(tilted.value - straight.value - tilt) / camera.noise
    assert np.quantile(off, 0.999) < ROUNDING
    assert off.max() < MAX_TILT_ERROR


@pytest.mark.parametrize("sign", [-1.0, 1.0, None], ids=["far", "near", "both"])
def test_outliers_do_not_move_the_surface(camera, noise, everywhere, sign):
    random = np.random.default_rng(1)
    lines = random.uniform(-OUTLIER_LINES, OUTLIER_LINES, camera.shape) if sign is None else sign * OUTLIER_LINES
    outliers = np.where(random.random(camera.shape) < OUTLIERS, lines * camera.line, 0.0)
    exact, here = camera.cylinder(100.0), inner(camera)
    clean, spoilt = (
        fit_facets(exact + noise + extra, everywhere, everywhere, camera.rays.dx) for extra in (0.0, outliers)
    )
    assert rms((spoilt.value - exact)[here]) < (1 + MAX_ERROR_RISE) * rms((clean.value - exact)[here])
    once = fit_quadratics(exact + noise + outliers, np.ones(camera.shape), everywhere, WIDE_RADIUS).terms[..., 0]
    assert rms((once - exact)[here]) > 5 * rms((clean.value - exact)[here])  # what least squares alone would do
    assert not spoilt.crease.any()


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 45.0])
@pytest.mark.parametrize("fold_deg", [45.0, 60.0, 90.0, 120.0])
def test_slopes_next_to_creases_are_one_sided(camera, noise, everywhere, fold_deg, angle_deg):
    exact = camera.roof(fold_deg, angle_deg, 100.3)
    facets = fit_facets(exact + noise, everywhere, everywhere, camera.rays.dx)
    across, _ = camera.about_ridge(angle_deg, 100.3)
    adjacent = inner(camera, 2 * WIDE_RADIUS) & (np.abs(across) < NEAR_RIDGE) & ~facets.crease
    errors = (facets.value - exact) / camera.noise
    rounded = fit_quadratics(exact + noise, np.ones(camera.shape), everywhere, WIDE_RADIUS).terms[..., 0]
    assert rms(errors[adjacent]) < MAX_ERROR_RATIO * rms(((rounded - exact) / camera.noise)[adjacent])
    assert np.abs(errors[adjacent & inner(camera, BORDER_MARGIN + HALF_WIDTH + HALF_LENGTH)]).max() < MAX_ERROR_NEAR
    assert np.abs(errors[adjacent]).max() < 2 * MAX_ERROR_NEAR  # nearer to the border the crease is known to a sample
    left, right = camera.walls(fold_deg, angle_deg, 100.3)
    own = np.where((left < right)[..., None], camera.facets(left), camera.facets(right))[..., 1:]
    jump = np.linalg.norm(own[0, 0] - own[-1, -1])
    off = np.linalg.norm(facets.slope - own, axis=2)[adjacent]
    assert np.quantile(off, 0.99) < 0.1 * jump  # in one step: each sample has the slope of its own side


def test_between_curved_walls_slopes_are_evaluated_at_the_sample(camera, noise, everywhere):
    """The window of a sample beside the crease lies to one side of it, and its quadratic has another slope there."""
    across, _ = camera.about_ridge(0.0, 100.3)
    bend = 0.4 * camera.noise  # a sample; over a window's reach as much as ten times the slope's noise
    exact = camera.roof(90.0, 0.0, 100.3) + bend * across**2
    facets = fit_facets(exact + noise, everywhere, everywhere, camera.rays.dx)
    left, right = camera.walls(90.0, 0.0, 100.3)
    own = np.where(left < right, camera.facets(left)[..., 1], camera.facets(right)[..., 1]) + 2 * bend * across
    adjacent = inner(camera, 2 * WIDE_RADIUS) & (np.abs(across) < NEAR_RIDGE) & ~facets.crease
    assert rms((facets.slope[..., 0] - own)[adjacent]) < MAX_ONE_SIDED_ERROR * camera.noise


def test_next_to_a_spine_slopes_are_right_though_the_walls_bend_fast(camera, noise, everywhere):
    """The walls of an open book get steeper towards the spine, faster than any quadratic over the grid."""
    exact, along = camera.book(SPINE_DEG, SPINE_REACH_MM, 100.3)
    facets = fit_facets(exact[..., 0] + noise, everywhere, everywhere, camera.rays.dx)
    adjacent = inner(camera, 2 * WIDE_RADIUS) & (np.abs(along) < NEAR_SPINE_MM) & ~facets.crease
    assert np.mean((facets.slope[..., 0] / exact[..., 1])[adjacent]) == pytest.approx(1.0, abs=MAX_SPINE_ERROR)


@pytest.mark.parametrize("quiet", [0.0, 0.02, 0.1])
def test_a_quieter_scanner_makes_no_worse_slopes(camera, noise, everywhere, quiet):
    """What its quadratics miss beside a narrow spine is many times its noise, and yet no outlier."""
    exact, along = camera.book(STEEP_DEG, NARROW_REACH_MM, 100.3)
    near = inner(camera, 2 * WIDE_RADIUS) & (np.abs(along) < NEAR_SPINE_MM)

    def error(share):
        facets = fit_facets(exact[..., 0] + share * noise, everywhere, everywhere, camera.rays.dx)
        return rms((facets.slope[..., 0] - exact[..., 1])[near & ~facets.crease])

    assert error(quiet) < 0.5 * error(1.0)


@pytest.mark.parametrize("share", [0.5, 0.7, 1.0])
def test_a_column_of_the_table_at_the_border_does_not_turn_the_facets(camera, noise, everywhere, share):
    """Seen beside a page that lies a little higher; no window is bent to pass it."""
    random = np.random.default_rng(3)
    page = camera.plane()
    data = page + noise
    data[:, 0] -= TABLE_SIGMAS * camera.noise * (random.random(len(data)) < share)
    facets = fit_facets(data, everywhere, everywhere, camera.rays.dx)
    right = np.gradient(page, axis=1)
    assert np.abs(facets.slope[..., 0] - right)[:, :WIDE_RADIUS].max() < MAX_BORDER_SLOPE * camera.noise


def test_an_undetected_fold_is_rounded_only_slightly(camera, noise, everywhere):
    for column in (100.0, 100.25, 100.5):
        exact = camera.roof(FAINT_FOLD_DEG, 20.0, column)
        errors = (fit_facets(exact + noise, everywhere, everywhere, camera.rays.dx).value - exact) / camera.noise
        assert np.abs(errors[inner(camera)]).max() < MAX_FAINT_FOLD_ERROR


def test_dark_samples_have_less_weight(camera, noise, everywhere):
    """A black picture on the page, ten times darker: its samples scatter √10 times as much."""
    ink = np.zeros(camera.shape, bool)
    ink[50:110, 60:140] = True
    signal = np.where(ink, 20.0, 200.0)
    exact = camera.cylinder(100.0)
    data = exact + np.where(ink, np.sqrt(10.0), 1.0) * noise
    reported, untold = (fit_facets(data, everywhere, everywhere, camera.rays.dx, light) for light in (signal, None))
    assert reported.noise == pytest.approx(camera.noise, rel=SAMPLING_ERROR)
    assert np.isfinite(reported.value[ink]).all()
    assert rms((reported.value - exact)[ink]) == pytest.approx(
        centre_noise(WIDE_RADIUS)[0] * np.sqrt(10.0) * camera.noise, rel=3 * SAMPLING_ERROR
    )
    adjacent = ~ink & inner(camera)
    adjacent[:48] = adjacent[112:] = False
    adjacent[:, :58] = adjacent[:, 142:] = False
    assert rms((reported.value - exact)[adjacent]) < 0.8 * rms((untold.value - exact)[adjacent])


def test_drop_outs_are_filled_inside_the_mask_only(camera, noise, everywhere):
    random = np.random.default_rng(2)
    measured = random.random(camera.shape) > 0.3
    wanted = inner(camera, 10)
    exact = camera.cylinder(100.0)
    facets = fit_facets(np.where(measured, exact + noise, np.nan), measured, wanted, camera.rays.dx)
    np.testing.assert_array_equal(np.isfinite(facets.value), wanted)
    errors = (facets.value - exact)[wanted] / camera.noise
    assert rms(errors) == pytest.approx(centre_noise(WIDE_RADIUS)[0] / np.sqrt(0.7), rel=0.1)  # so many samples fewer
    assert np.abs(errors).max() < MAX_ERROR


def test_a_hole_wider_than_the_widest_window_stays_open(camera, noise, everywhere):
    measured = everywhere.copy()
    measured[50:110, 60:140] = False
    facets = fit_facets(np.where(measured, camera.plane() + noise, np.nan), measured, everywhere, camera.rays.dx)
    assert np.isnan(facets.value[75:85, 85:115]).all()
    assert np.isfinite(facets.value[measured & inner(camera)]).all()


@pytest.mark.parametrize("left", [0.0, 0.06, 0.12, 0.3])
def test_where_dark_ink_leaves_few_samples_the_surface_goes_on_over_wider_windows(camera, noise, everywhere, left):
    """A dark picture, 12 samples high, with three times the noise: a slope from 7×7 samples would be anything."""
    ink = np.zeros(camera.shape, bool)
    ink[74:86, 60:140] = True
    measured = ~ink | (np.random.default_rng(4).random(camera.shape) < left)
    exact, signal = camera.cylinder(100.0), np.where(ink, 20.0, 200.0)
    data = np.where(measured, exact + np.where(ink, 3.0, 1.0) * noise, np.nan)
    facets = fit_facets(data, measured, everywhere, camera.rays.dx, signal)
    value, slope = facets.value - exact, facets.slope - camera.facets(exact)[..., 1:]
    assert np.abs(value[ink]).max() < MAX_ERROR * camera.noise
    assert np.abs(slope[ink]).max() < MAX_SPARSE_SLOPE * camera.noise


def test_a_sample_off_the_sheet_has_no_part_in_it(camera, noise, everywhere):
    """Beside the page one was measured that mixes page and table."""
    inside = everywhere.copy()
    inside[:, :40] = False
    measured = inside.copy()
    measured[80, 39] = True
    data = np.where(measured, camera.plane() + noise, np.nan)
    data[80, 39] -= TABLE_SIGMAS * camera.noise
    with_it = fit_facets(data, measured, inside, camera.rays.dx)
    without = fit_facets(np.where(inside, data, np.nan), inside, inside, camera.rays.dx)
    np.testing.assert_allclose(with_it.value, without.value, atol=ROUNDING * camera.noise)


def test_samples_too_sparse_for_any_facet_raise_not_enough_surface(camera, noise, everywhere):
    measured = np.zeros(camera.shape, bool)
    measured[::3, ::3] = True
    with pytest.raises(NotEnoughSurface, match="too far apart"):
        fit_facets(np.where(measured, camera.plane() + noise, np.nan), measured, everywhere, camera.rays.dx)
