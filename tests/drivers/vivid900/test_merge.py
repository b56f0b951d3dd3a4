"""Averages, depths and exposures of shots, without a scanner."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.scanner import DeviceError
from drivers.vivid900.calibration import nominal
from drivers.vivid900.commands import Parameters
from drivers.vivid900.exposure import GAIN_STEP, PAPER_LEVEL, brightness, expose, is_well_exposed, middle_of
from drivers.vivid900.lenses import FINE, LENSES, depth_window
from drivers.vivid900.merge import average, cover_depths, merge_depths, next_depth
from drivers.vivid900.pitch import Pitch
from drivers.vivid900.rest import at_rest

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


def test_beyond_the_scanners_range_there_is_no_next() -> None:
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


@given(st.integers(1, 255), st.integers(0, 7), st.floats(0.5, 254), st.booleans())
def test_exposure_comes_out_right_as_far_as_the_laser_goes(power: int, gain: int, level: float, fixed: bool) -> None:
    before = Parameters(laser_power=power, gain=gain)
    after = expose(before, level, gain_is_fixed=fixed)
    comes_out = level * after.laser_power / power * GAIN_STEP ** (after.gain - gain)
    limited = after.laser_power in (1, 255) and (fixed or after.gain in (0, 7))
    assert limited or is_well_exposed(comes_out) or after.laser_power < 3  # steps of the power are coarse there
    assert not fixed or after.gain == gain


def test_paper_is_what_is_bright() -> None:
    intensity = np.full(SHAPE, PAPER_LEVEL, np.uint8)
    intensity[:20] = 8  # a third is ink
    intensity[0] = 255  # and a line is gloss
    pitch = Pitch(np.zeros(SHAPE), intensity)
    assert brightness(pitch) == PAPER_LEVEL
    assert brightness(replace(pitch, intensity=np.zeros(SHAPE, np.uint8))) == 0


def test_the_middle_of_the_depth() -> None:
    points = plane(900.0)
    points[:30, :, 2] = -1000
    middle = middle_of(points, 21.5)
    assert middle == pytest.approx(2 / (1 / 900 + 1 / 1000) - 21.5)
    assert middle_of(np.full((*SHAPE, 3), np.nan), 21.5) is None
    assert middle_of(plane(100.0), 21.5) == 500


def test_everything_comes_to_rest_in_order_whatever_fails() -> None:
    done: list[str] = []

    def jam() -> None:
        done.append("stage")
        raise DeviceError("jammed")

    with (
        pytest.raises(DeviceError, match="jammed"),
        at_rest([lambda: done.append("laser"), jam, lambda: done.append("lamp")]),
    ):
        done.append("work")
    assert done == ["work", "laser", "stage", "lamp"]
    with pytest.raises(KeyboardInterrupt) as stopped, at_rest([jam]):
        raise KeyboardInterrupt
    assert stopped.value.__notes__ == ["and the scanner could not be brought to rest: jammed"]
