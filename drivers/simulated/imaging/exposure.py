"""Exposure model: brightness of white paper from laser power and gain."""

from __future__ import annotations

import numpy as np

from drivers.vivid900.geometry.lenses import REFERENCE_MM
from drivers.vivid900.settings import MAX_GAIN, MAX_LASER_POWER

PAPER_POWER = 30.0  # laser power for white paper at REFERENCE_MM; operators report 23 for a bright plate
GAIN_STEP = 2**0.5  # brightness from one CCD gain to the next; the manual names the steps, not their size


def relative_exposure(distance_mm: float, power: int, gain: int) -> float:
    """Exposure of a shot, 1 for white paper well exposed at the focus distance."""
    return power * GAIN_STEP**gain / (PAPER_POWER * (distance_mm / REFERENCE_MM) ** 2)


def exposure_for_paper(distance_mm: float) -> tuple[int, int]:
    """Return (laser power, gain) that expose white paper well.

    At a distance: power first, gain above full power.
    """
    needed = PAPER_POWER * (distance_mm / REFERENCE_MM) ** 2
    power = min(max(round(needed), 1), MAX_LASER_POWER)
    gain = round(float(np.log(needed / power) / np.log(GAIN_STEP)))
    return power, min(max(gain, 0), MAX_GAIN)
