"""The camera rays fitted to a scan, and the maps between grid and space that they define."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from restore.camera.rays import MIN_POINTS, Rays, find_rays
from restore.errors import NotEnoughSurface

EXACT = 1e-12  # of a line of sight's tangent: rounding of a straight line fitted to 30,000 samples
ROUND_TRIP = 1e-8  # samples: a metre holds twelve digits of a micrometre, a sample has half a millimetre
TWO_DECIMALS = 5e-3  # samples at either end of the grid: 0.01 mm is a fiftieth of a sample, and 200 columns average it

shifts = st.floats(-500.0, 500.0)
turns = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1)


def ends(rays, camera):
    last = np.array([0.0, camera.rows - 1.0]), np.array([0.0, camera.cols - 1.0])
    return rays.points(*last, np.ones(2))[:, :2]


def test_a_pinhole_is_fitted_to_a_curved_surface_with_gaps(camera):
    inverse_depth = camera.cylinder(80.0)
    inverse_depth[40:60, 50:90] = np.nan
    found = find_rays(camera.shot(inverse_depth))
    assert found is not None
    np.testing.assert_allclose(ends(found, camera), ends(camera.rays, camera), atol=EXACT)


def test_a_scan_written_with_two_decimals_is_still_one_pinhole(camera):
    scan = camera.shot(camera.cylinder(80.0))
    found = find_rays(replace(scan, points=scan.points.round(2)))
    assert found is not None
    np.testing.assert_allclose(ends(found, camera), ends(camera.rays, camera), atol=TWO_DECIMALS * camera.rays.dx)


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.floats(-50, 700), st.floats(-50, 700), st.floats(400, 2500)), min_size=1, max_size=20),
    turns,
    st.tuples(shifts, shifts, shifts),
)
def test_projection_inverts_back_projection_for_any_camera_pose(samples, turn, origin):
    rows, cols, depth = np.array(samples).T
    rays = Rays(-0.16, 1 / 1942.8, 0.12, -1 / 1942.8, Rotation.from_quat(turn).as_matrix(), np.array(origin))
    points = rays.points(rows, cols, 1 / depth)
    back_rows, back_cols = rays.grid(points)
    np.testing.assert_allclose(back_rows, rows, atol=ROUND_TRIP)
    np.testing.assert_allclose(back_cols, cols, atol=ROUND_TRIP)
    own = (points - origin) @ rays.axes.T
    np.testing.assert_allclose(-own[:, 2], depth, rtol=EXACT)


def test_the_default_camera_frame_is_the_scanners(camera):
    middle = camera.rays.points(np.array((camera.rows - 1) / 2), np.array((camera.cols - 1) / 2), np.array(0.001))
    np.testing.assert_allclose(middle, [0, 0, -1000.0], atol=1e-9)


def moved(scan):
    """The left half as a second view, taken 20 mm beside the first, would add it."""
    points = scan.points.copy()
    points[:, : points.shape[1] // 2] += [20.0, 0.0, 0.0]
    return replace(scan, points=points)


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(moved, id="two merged views"),
        pytest.param(lambda scan: replace(scan, points=scan.points * [-1, 1, 1]), id="mirrored"),
        pytest.param(lambda scan: replace(scan, points=scan.points * [1, -1, 1]), id="bottom row first"),
        pytest.param(lambda scan: replace(scan, points=scan.points + [0, 0, 2000]), id="behind the lens"),
        pytest.param(
            lambda scan: replace(scan, points=scan.points @ Rotation.from_euler("z", 20, degrees=True).as_matrix()),
            id="turned since",
        ),
    ],
)
def test_samples_not_on_the_rays_of_one_camera_give_none(camera, change):
    assert find_rays(change(camera.shot(camera.cylinder(80.0)))) is None


@pytest.mark.parametrize("rows, cols", [(1, 200), (160, 1), (7, 7), (0, 0)])
def test_too_few_samples_raise_not_enough_surface(camera, rows, cols):
    inverse_depth = np.full(camera.shape, np.nan)
    inverse_depth[:rows, :cols] = camera.plane()[:rows, :cols]
    assert rows * cols < MIN_POINTS or min(rows, cols) < 3
    with pytest.raises(NotEnoughSurface, match=rf"holds {rows * cols} samples") as caught:
        find_rays(camera.shot(inverse_depth))
    assert caught.value.hint


bends = st.tuples(st.floats(-0.15, 0.15), st.floats(-0.2, 0.2))


def seen_through(rays, camera, inverse_depth):
    points = rays.points(*camera.indices, inverse_depth)
    return replace(camera.shot(inverse_depth), points=points)


@settings(deadline=None)
@given(bends)
def test_lens_distortion_is_recovered_from_points(camera, bend):
    rays = replace(camera.rays, x0=-0.16, y0=0.12, dx=0.32 / camera.cols, dy=-0.24 / camera.rows, distortion=bend)
    points = rays.points(*camera.indices, camera.plane())
    for found, wanted in zip(rays.grid(points), camera.indices, strict=True):
        np.testing.assert_allclose(found, wanted, atol=ROUND_TRIP)


@pytest.mark.parametrize("decimals", [12, 2])
def test_the_distortion_of_a_wide_lens_is_estimated(camera, decimals):
    wide = replace(camera.rays, x0=-0.3, y0=0.22, dx=0.6 / camera.cols, dy=-0.44 / camera.rows, distortion=(-0.1, 0.05))
    scan = seen_through(wide, camera, camera.cylinder(80.0))
    found = find_rays(replace(scan, points=scan.points.round(decimals)))
    assert found is not None
    for place, wanted in zip(found.grid(scan.points), camera.indices, strict=True):
        np.testing.assert_allclose(place, wanted, atol=TWO_DECIMALS if decimals == 2 else ROUND_TRIP)


def test_rounding_is_not_fitted_as_distortion(camera):
    scan = camera.shot(camera.cylinder(80.0))
    found = find_rays(replace(scan, points=scan.points.round(2)))
    assert found is not None
    assert found.distortion == (0.0, 0.0)
