"""Fits over tangent planes, against surfaces whose slopes are known."""

import numpy as np
import pytest

from restore.range_image.facets.facet_model import WIDE_RADIUS
from restore.range_image.facets.quadratic_fit import MIN_SAMPLES, fit_quadratics
from restore.range_image.facets.tangent_fit import CUBIC, _on_line_of_sight, _set_axes, fit_over_tangents

RADIUS_MM = 50.0  # of a cylinder that the camera sees up to a slope of 83°
STEEP = 1.0  # slope from which the quadratics are compared
TIMES_BETTER = 100.0
MAX_ERROR = 2e-3  # of the slope of 45°: a window turns by 5° to either side, and lines of sight count as parallel
BOOK_DEG, BOOK_REACH_MM, SPINE = 66.0, 25.0, 100.3
MAX_BOOK_ERROR = 2e-3  # of the slope, beside the spine: what is left by a cubic over the tangent plane


@pytest.fixture
def steep(camera):
    """Slope of 45°, in the inverse depth of a column."""
    return camera.rays.dx / 921.5


def fitted(data, weight, steep, wanted=None, centres=None):
    quadratics = fit_quadratics(data, weight, weight > 0, WIDE_RADIUS)
    centres = np.arange(data.size).reshape(data.shape) if centres is None else centres
    wanted = np.ones(data.shape, bool) if wanted is None else wanted
    return quadratics, fit_over_tangents(data, weight, wanted, quadratics.terms, centres, steep, WIDE_RADIUS)


def cylinder(camera):
    """Inverse depth of a cylinder, and its exact change per column."""
    inverse_depth = camera.cylinder(RADIUS_MM)
    points = camera.rays.points(*camera.indices, inverse_depth)
    axis = np.array([0.0, 0.0, -921.5 - RADIUS_MM])
    normals = (points - axis) * [1.0, 0.0, 1.0]
    return inverse_depth, normals[..., 0] * camera.rays.dx / (points * normals).sum(axis=-1)


def inner(camera):
    mask = np.zeros(camera.shape, bool)
    mask[WIDE_RADIUS:-WIDE_RADIUS, WIDE_RADIUS:-WIDE_RADIUS] = True
    return mask


def test_on_a_steep_curl_slopes_are_right_where_those_of_quadratics_are_not(camera, steep):
    data, across = cylinder(camera)
    quadratics, facets = fitted(data, np.ones(data.shape), steep)
    here = inner(camera) & (np.abs(across) > STEEP * steep)
    own = np.abs(facets[..., 1] - across)[here].max()
    assert own < MAX_ERROR * steep
    assert np.abs(quadratics.terms[..., 1] - across)[here].max() > TIMES_BETTER * own
    assert np.abs(facets[..., 2])[here].max() < MAX_ERROR * steep + np.abs(np.gradient(data, axis=0)).max()
    assert np.abs(facets[..., 0] - data)[here].max() < MAX_ERROR * steep


def test_noise_is_estimated_in_inverse_depth_whatever_the_slope(camera, steep):
    data, across = cylinder(camera)
    noise = np.random.default_rng(0).normal(0.0, camera.noise, data.shape)
    _, facets = fitted(data + noise, np.ones(data.shape), steep)
    for here in (np.abs(across) < STEEP * steep, np.abs(across) > STEEP * steep):
        assert np.sqrt(np.nanmean(facets[..., 3][here & inner(camera)])) == pytest.approx(camera.noise, rel=0.1)


def test_next_to_a_spine_the_window_of_one_wall_shows_the_slope_at_its_edge(camera, steep):
    exact, along = camera.book(BOOK_DEG, BOOK_REACH_MM, SPINE)
    column = int(np.flatnonzero(along > 0)[0])
    centres = np.arange(exact[..., 0].size).reshape(camera.shape)
    centres[:, column] = centres[:, column + WIDE_RADIUS]
    data = np.where(along > 0, exact[..., 0], 0.0)
    _, facets = fitted(data, np.broadcast_to((along > 0).astype(float), camera.shape).copy(), steep, centres=centres)
    np.testing.assert_allclose(facets[20:-20, column, 1] / exact[20:-20, column, 1], 1.0, atol=MAX_BOOK_ERROR)


def test_only_wanted_samples_with_enough_neighbours_are_fitted(camera, steep):
    data = camera.plane()
    weight, wanted = np.ones(data.shape), np.zeros(data.shape, bool)
    wanted[10:20, 10:20] = True
    weight[10:18, 10:20] = 0.0
    weight[12, 12] = 1.0  # alone
    _, facets = fitted(data, weight, steep, wanted)
    assert not np.isfinite(facets[~wanted]).any()
    assert np.isnan(facets[12, 12]).all()
    assert np.isfinite(facets[18:20, 10:20]).all()


def test_three_columns_determine_a_quadratic_but_no_cubic(camera, steep):
    """However far it rises: there are samples enough, but at three places across."""
    data, _ = cylinder(camera)
    weight = np.zeros(data.shape)
    weight[:, 10:13] = 1.0
    assert MIN_SAMPLES < 7 * 3 > 2 * CUBIC
    _, facets = fitted(data, weight, steep)
    assert np.isfinite(facets[20:-20, 11]).all()


def test_where_the_surface_turns_too_far_nothing_is_estimated(camera, steep):
    """A step of ten columns' depth: the window of one side knows nothing of the other."""
    data = camera.plane() + 10.0 * steep * (np.indices(camera.shape)[1] > 100)
    noise = np.random.default_rng(1).normal(0.0, camera.noise, data.shape)
    _, facets = fitted(data + noise, np.ones(data.shape), steep)
    known = np.isfinite(facets)
    np.testing.assert_array_equal(known.all(axis=2), known.any(axis=2))


def test_a_surface_that_is_seen_edge_on_has_no_facet():
    axes, surface = np.empty((3, 3)), np.zeros(CUBIC)
    _set_axes(1.0, 0.0, WIDE_RADIUS, axes)
    assert _on_line_of_sight(0, 0, axes, surface) == pytest.approx((0.0, 1.0, 0.0))
    surface[1] = 1.0  # another 45°, away from the plane
    assert np.isnan(_on_line_of_sight(0, 0, axes, surface)).all()
