"""A page that is moved between shots, by less than a pixel."""

from __future__ import annotations

import numpy as np

from drivers import CaptureSettings
from drivers.simulated import connect
from drivers.vivid900.lenses import LENSES, project

LENS, DISTANCE_MM = "MIDDLE", 900.0
CONFIG = {"driver": "simulated", "lens": LENS, "distance_mm": DISTANCE_MM, "scene": {"sheet": "flat"}}


def middles(nudge_px: float, shots: int = 3) -> np.ndarray:
    """(shots, 2) pixel that the middle of the page is seen at."""
    found = []
    with connect({**CONFIG, "nudge_px": nudge_px}) as scanner:
        for _ in range(shots):
            scanner.capture(CaptureSettings(mode="fast"))
            found.append(project(LENSES[LENS], scanner.truth.surface(np.array([140.0, 100.0]))))
    return np.array(found)


def test_the_page_lies_still_unless_it_is_nudged():
    assert np.ptp(middles(0.0, shots=2), axis=0).max() == 0


def test_nudges_are_within_their_reach_and_never_twice_the_same():
    moved = middles(0.8) - middles(0.0, shots=1)
    np.testing.assert_array_equal(moved[0], 0)
    assert np.abs(moved).max() <= 0.8 + 1e-9
    assert (np.abs(np.diff(moved, axis=0)) > 0.01).all()
