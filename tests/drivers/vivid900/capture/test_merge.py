"""Averaging and merging of shots, without a scanner."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.vivid900.capture.merge import average, cover_depths, merge_depths, next_depth
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import FINE, LENSES, depth_window

LENS = LENSES["MIDDLE"]
BODY = nominal(LENS)
SHAPE = (60, 80)
# Four standard errors of a standard deviation estimated from 4,800 samples.
SPREAD = 4 / np.sqrt(2 * SHAPE[0] * SHAPE[1])


@pytest.mark.parametrize("number", [2, 4, 9])
def test_noise_falls_with_the_square_root(number: int) -> None:
    rng = np.random.default_rng(4)
    shots = [100 + rng.normal(0, 0.02, SHAPE) for _ in range(number)]
    assert np.std(average(shots, FINE)) == pytest.approx(0.02 / np.sqrt(number), rel=SPREAD)


def test_strays_and_gaps_do_not_count() -> None:
    shots = [np.full(SHAPE, 10.0) for _ in range(4)]
    shots[1][0, 0] = 13.0
    shots[2][1, :] = np.nan
    for shot in shots:
        shot[2, :] = np.nan
    mean = average(shots, FINE)
    assert (mean[:2] == 10).all()
    assert np.isnan(mean[2]).all()


def test_one_shot_is_its_own_average() -> None:
    shot = np.arange(6.0).reshape(2, 3)
    assert average([shot], FINE) is shot


def plane(depth: float) -> np.ndarray:
    points = np.zeros((*SHAPE, 3))
    points[..., 2] = -depth
    return points


def test_the_next_depth_adjoins() -> None:
    near, far = depth_window(LENS, FINE, 900)
    assert next_depth(plane(921.5), LENS, FINE, 900, nearer=True) is None
    nearer = next_depth(plane(near + 1), LENS, FINE, 900, nearer=True)
    farther = next_depth(plane(far - 1), LENS, FINE, 900, nearer=False)
    assert nearer is not None
    assert farther is not None
    assert near < depth_window(LENS, FINE, nearer)[1] < near + 0.3 * (far - near)
    assert far - 0.3 * (far - near) < depth_window(LENS, FINE, farther)[0] < far


def test_the_scanners_range_ends_the_search() -> None:
    near, _ = depth_window(LENS, FINE, 510)
    assert next_depth(plane(near + 0.1), LENS, FINE, 510, nearer=True) is None
    assert next_depth(np.full((*SHAPE, 3), np.nan), LENS, FINE, 900, nearer=True) is None


def test_depths_are_covered_as_far_as_the_surface_goes() -> None:
    depth = np.broadcast_to(np.linspace(800, 1050, SHAPE[1]), SHAPE)

    def shoot(distance: int) -> np.ndarray:
        near, far = depth_window(LENS, FINE, distance)
        points = np.zeros((*SHAPE, 3))
        points[..., 2] = np.where((depth > near) & (depth < far), -depth, np.nan)
        return points

    shots = cover_depths(shoot, 900, LENS, FINE)
    assert shots[0][0] == 900
    np.testing.assert_allclose(-merge_depths(shots, BODY, FINE)[..., 2], depth)


def test_of_two_shots_the_better_focused_counts() -> None:
    merged = merge_depths([(900, plane(940.0)), (950, plane(941.0))], BODY, FINE)
    # 921.5 is nearer to it than 971.5, and the two differ by more than any noise.
    np.testing.assert_allclose(merged[..., 2], -940)
    gap = plane(940.0)
    gap[0] = np.nan
    np.testing.assert_allclose(merge_depths([(900, gap), (950, plane(941.0))], BODY, FINE)[0, :, 2], -941)
