"""Pitch to points and back, against geometry done by hand."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.vivid900.geometry.calibration import Calibration, nominal
from drivers.vivid900.geometry.lenses import BASELINE_MM, FAST, FINE, LENSES, MODES, depth_window, texture_grid
from drivers.vivid900.geometry.triangulation import (
    in_window,
    lines_of_sight,
    pitch_at,
    pitch_of,
    points_of,
    project,
    tangents,
)

ROUND_TRIP = 1e-9  # frames and millimetres: a hundred-thousandth of the sensor's noise
ROUNDING = 1e-12  # of tangents near 1 in double precision

small = st.floats(-0.004, 0.004)
bodies = st.builds(
    Calibration,
    body=st.just(""),
    lens=st.sampled_from(sorted(LENSES)),
    lens_serial=st.just(""),
    baseline_mm=st.floats(245, 255),
    focal_px=st.floats(1000, 3500),
    pupil_mm=st.floats(10, 25),
    centre_px=st.tuples(st.floats(310, 330), st.floats(230, 250)),
    distortion=st.tuples(st.floats(-0.15, 0.15), st.floats(-0.2, 0.2)),
    plane=st.tuples(small, small, small, small),
    tilt=small,
    bow=small,
)
BENT = replace(nominal(LENSES["MIDDLE"]), distortion=(-0.08, 0.1), plane=(2e-4, -2e-3, 1e-3, 1e-3), tilt=1e-3, bow=2e-3)


def test_by_hand() -> None:
    # The stripe crosses the sample on the axis in the middle of the block: the distance in focus.
    body = nominal(LENSES["MIDDLE"])
    pitch = np.full((480, 640), np.nan)
    pitch[239, 319] = 239 + 62
    x, y, z = points_of(pitch, body, FINE, 900.0)[239, 319]
    assert z == pytest.approx(-921.5, abs=ROUND_TRIP)
    assert (x, y) == pytest.approx((-0.5 / 1942.8 * 921.5, 0.5 / 1942.8 * 921.5), abs=ROUND_TRIP)
    # Ten frames later the plane is ten lines lower, and meets the line of sight farther out.
    pitch[239, 319] += 10
    disparity = BASELINE_MM / 921.5 - 10 / 1942.8
    assert points_of(pitch, body, FINE, 900.0)[239, 319, 2] == pytest.approx(-BASELINE_MM / disparity, abs=ROUND_TRIP)


@pytest.mark.parametrize("mode", MODES.values(), ids=list(MODES))
def test_the_sweep_takes_as_many_frames_as_the_manual_counts(mode) -> None:
    frames = mode.rows + mode.frames - 1
    assert frames == pytest.approx({"fine": 600, "fast": 270}[mode.name], rel=0.03)  # "approx." (p. 59)


@settings(max_examples=25, deadline=None)  # each takes a whole grid
@given(body=bodies, mode=st.sampled_from([FAST, FINE]), distance=st.floats(500, 2500), seed=st.integers(0, 99))
def test_pitch_and_points_undo_each_other(body: Calibration, mode, distance: float, seed: int) -> None:
    near, far = depth_window(LENSES[body.lens], mode, distance)
    depth = np.random.default_rng(seed).uniform(near, far, (mode.rows, mode.cols))
    pitch = pitch_at(body.baseline_mm / depth, body, mode, distance)
    points = points_of(pitch, body, mode, distance)
    np.testing.assert_allclose(-points[..., 2], depth, atol=ROUND_TRIP * depth.max() / 100)
    np.testing.assert_allclose(pitch_of(points, body, mode, distance), pitch, atol=ROUND_TRIP)


@settings(max_examples=25, deadline=None)  # each takes a whole grid
@given(body=bodies, mode=st.sampled_from([FAST, FINE]))
def test_every_pixel_is_seen_where_it_looks(body: Calibration, mode) -> None:
    points = points_of(pitch_at(np.full((mode.rows, mode.cols), 0.3), body, mode, 900.0), body, mode, 900.0)
    np.testing.assert_allclose(project(body, points), texture_grid(mode), atol=ROUND_TRIP)


def test_distortion_is_browns() -> None:
    at = np.array([[0.1, 0.05, -1.0], [-0.15, 0.11, -1.0]])
    squared = (at[:, :2] ** 2).sum(axis=1)
    radial = 1 - 0.08 * squared + 0.1 * squared**2
    wanted = np.array([319.5, 239.5]) + at[:, :2] * radial[:, None] * [1942.8, -1942.8]
    np.testing.assert_allclose(project(BENT, at), wanted, atol=ROUND_TRIP)
    np.testing.assert_allclose(tangents(BENT, wanted), at[:, :2], atol=ROUNDING)


def test_the_stripe_is_the_plane_of_the_model() -> None:
    # Samples that the stripe crosses in one and the same frame lie on one tilted and bowed surface.
    points = points_of(np.full((480, 640), 301.0), BENT, FINE, 900.0)
    u, disparity = points[..., 0] / -points[..., 2], (points[..., 1] + BENT.baseline_mm) / -points[..., 2]
    flat = disparity - BENT.tilt * u - BENT.bow * u**2
    assert np.ptp(flat) < ROUNDING
    sent = (239.5 - 239) / 1942.8 + BASELINE_MM / 921.5
    p0, p1, p2, p3 = BENT.plane
    assert flat[0, 0] == pytest.approx(sent + p0 + p1 * sent + p2 * sent**2 + p3 * sent**3, abs=ROUNDING)


def test_nothing_measured_and_nothing_in_front_are_nan() -> None:
    body = nominal(LENSES["WIDE"])
    pitch = np.full((240, 320), np.nan)
    pitch[0, 0], pitch[1, 1] = 17.5, 1e6  # in the block; a plane that meets the line of sight behind the lens
    points = points_of(pitch, body, FAST, 700.0)
    assert np.isfinite(points[0, 0]).all()
    assert np.isnan(points).sum() == 3 * (240 * 320 - 1)


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("mode", MODES.values(), ids=list(MODES))
def test_the_window_of_the_block_is_the_depth_window(lens: str, mode) -> None:
    body = nominal(LENSES[lens])
    near, far = depth_window(LENSES[lens], mode, 800.0)
    for depth, within in ((near * 1.001, True), (far * 0.999, True), (near * 0.999, False), (far * 1.001, False)):
        pitch = pitch_at(np.full((mode.rows, mode.cols), BASELINE_MM / depth), body, mode, 800.0)
        assert (in_window(pitch, body, mode) == within).all()


def test_lines_of_sight_are_kept() -> None:
    assert lines_of_sight(BENT, FINE) is lines_of_sight(replace(BENT), FINE)
