"""Light on a chart: found where it is uneven, and not where only the patches err."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from station.colour.evenness import EVEN, measure_evenness

WANTED = np.random.default_rng(8).permutation(np.linspace(0.03, 0.9, 24))
ERROR = 0.03  # relative, of a patch's luminance
OFF = 0.05  # of the fall-off, by that error


def lamp(fall_off, way):
    y, x = np.meshgrid(np.linspace(-1, 1, 4), np.linspace(-1, 1, 6), indexing="ij")
    along = (np.cos(way) * x + np.sin(way) * y).ravel()
    return 1 - fall_off * (along - along.min()) / np.ptp(along)


@settings(max_examples=40, deadline=None)
@given(fall_off=st.floats(0.4, 0.7), way=st.floats(0, 6.3), seed=st.integers(0, 999))
def test_a_fall_off_is_found_wherever_it_leads(fall_off, way, seed):
    # Of 0.2 one draw in some 400 is lost in such errors of the patches.
    light = lamp(fall_off, way)
    seen = WANTED * light * (1 + ERROR * np.random.default_rng(seed).normal(size=24))
    found = measure_evenness(seen, WANTED)
    assert found.fall_off == pytest.approx(fall_off, abs=2 * OFF)
    assert found.light.max() == pytest.approx(1.0)
    assert np.corrcoef(found.light, light)[0, 1] > 0.95


def test_errors_of_the_patches_alone_are_not_a_lamp():
    rng = np.random.default_rng(3)
    found = [measure_evenness(WANTED * (1 + 2 * ERROR * rng.normal(size=24)), WANTED) is EVEN for _ in range(300)]
    assert np.mean(found) > 0.99


def test_a_brighter_exposure_and_exact_patches_are_even():
    assert measure_evenness(1.3 * WANTED, WANTED) is EVEN
    assert measure_evenness(WANTED, WANTED) is EVEN


def test_black_patches_do_not_decide():
    seen = WANTED.copy()
    seen[WANTED < 0.06] = 0.0
    assert measure_evenness(seen, WANTED) is EVEN
