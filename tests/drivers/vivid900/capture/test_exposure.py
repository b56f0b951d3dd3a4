"""Laser power, gain and focus distance chosen from a preview."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.vivid900.capture.exposure import (
    GAIN_STEP,
    PAPER_LEVEL,
    brightness,
    centring_distance,
    corrected_exposure,
    is_well_exposed,
)
from drivers.vivid900.capture.pitch import Pitch
from drivers.vivid900.profile.commands import Parameters

SHAPE = (60, 80)


@given(st.integers(1, 255), st.integers(0, 7), st.floats(0.5, 254), st.booleans())
def test_exposure_comes_out_right_as_far_as_the_laser_goes(power: int, gain: int, level: float, fixed: bool) -> None:
    before = Parameters(laser_power=power, gain=gain)
    after = corrected_exposure(before, level, gain_is_fixed=fixed)
    comes_out = level * after.laser_power / power * GAIN_STEP ** (after.gain - gain)
    limited = after.laser_power in (1, 255) and (fixed or after.gain in (0, 7))
    assert limited or is_well_exposed(comes_out) or after.laser_power < 3  # steps of the power are coarse there
    assert not fixed or after.gain == gain


def test_paper_is_what_is_bright() -> None:
    intensity = np.full(SHAPE, PAPER_LEVEL, np.uint8)
    intensity[:20] = 8  # a third is ink
    intensity[0] = 255  # and a line is gloss
    pitch = Pitch(np.zeros(SHAPE), intensity)
    assert brightness(pitch.intensity) == PAPER_LEVEL
    assert brightness(np.zeros(SHAPE, np.uint8)) == 0


def test_the_middle_of_the_depth() -> None:
    points = np.full((*SHAPE, 3), -900.0)
    points[:30, :, 2] = -1000
    middle = centring_distance(points, 21.5)
    assert middle == pytest.approx(2 / (1 / 900 + 1 / 1000) - 21.5)
    assert centring_distance(np.full((*SHAPE, 3), np.nan), 21.5) is None
    assert centring_distance(np.full((*SHAPE, 3), -100.0), 21.5) == 500
