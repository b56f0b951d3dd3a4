"""A flat plate before the simulated scanner, without ray casting or noise: for tests that shoot thousands of times.

Every shot tells which it is, by its colour and by where the plate stands, so that a mixed-up shot can be told.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from drivers.simulated.exposing import exposure_of
from drivers.simulated.sensor import add_up
from drivers.vivid900.calibration import nominal
from drivers.vivid900.lenses import LENSES, TEXTURE_COLS, TEXTURE_ROWS, Mode
from drivers.vivid900.pitch import Sums
from drivers.vivid900.triangulation import in_window, pitch_at
from restore.scan import Bytes

STEP_MM, PLACES = 0.5, 5  # the plate moves back by a step from shot to shot, and returns after so many
DARKEST, SHADES = 100, 100


@dataclass(frozen=True)
class PlateSensor:
    """A white plate square to the axis of a lens with the manual's figures.

    distance_mm  where it stands in its first place, from the front of the lens.
    """

    distance_mm: float = 900.0
    contrast: bool = True
    lens: str = "MIDDLE"

    def place_mm(self, shot: int) -> float:
        """Where it stands in a shot, from the front of the lens."""
        return self.distance_mm + STEP_MM * (shot % PLACES)

    def sweep(self, mode: Mode, distance_mm: float, power: int, gain: int, shot: int) -> Sums:
        """See Sensor."""
        return _sums(self.lens, mode, self.place_mm(shot), distance_mm, power, gain)

    def colour(self, shot: int) -> Bytes:
        """See Sensor: an even grey of the shot's own."""
        return np.full((TEXTURE_ROWS, TEXTURE_COLS, 3), DARKEST + shot % SHADES, np.uint8)


@lru_cache(maxsize=16)  # 0.7 MB each in FAST
def _sums(lens: str, mode: Mode, plate_mm: float, distance_mm: float, power: int, gain: int) -> Sums:
    body = nominal(LENSES[lens])
    disparity = np.full((mode.rows, mode.cols), body.baseline_mm / (plate_mm + body.pupil_mm))
    pitch = pitch_at(disparity, body, mode, distance_mm)
    signal = np.full(pitch.shape, exposure_of(distance_mm, power, gain))
    return add_up(np.where(in_window(pitch, body, mode) & (signal > 0), pitch, np.nan), signal)
