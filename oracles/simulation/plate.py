"""A sensor that sees a flat plate, without ray casting or noise.

It serves tests with thousands of captures. Colour and distance of the plate encode the number of the capture, so that
data of another one is detected.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from drivers.simulated.imaging.exposure import relative_exposure
from drivers.simulated.imaging.sensor import quantise
from drivers.vivid900.capture.pitch import Sums
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import LENSES, Mode
from drivers.vivid900.geometry.triangulation import in_window, pitch_at
from restore.scan import Bytes
from restore.vivid import TEXTURE_COLS, TEXTURE_ROWS

STEP_MM, PLACES = 0.5, 5  # the plate moves back by a step from shot to shot, and returns after PLACES shots
DARKEST, SHADES = 100, 100


@dataclass(frozen=True)
class PlateSensor:
    """A white plate square to the axis of a lens with the manual's figures.

    distance_mm  its first distance from the front of the lens.
    """

    distance_mm: float = 900.0
    contrast: bool = True
    lens: str = "MIDDLE"

    def place_mm(self, shot: int) -> float:
        """Its distance in a shot from the front of the lens, mm."""
        return self.distance_mm + STEP_MM * (shot % PLACES)

    def sweep(self, mode: Mode, distance_mm: float, power: int, gain: int, shot: int) -> Sums:
        """See Sensor."""
        return _sums(self.lens, mode, self.place_mm(shot), distance_mm, power, gain)

    def colour(self, shot: int) -> Bytes:
        """See Sensor: a uniform grey that encodes the shot."""
        return np.full((TEXTURE_ROWS, TEXTURE_COLS, 3), DARKEST + shot % SHADES, np.uint8)


@lru_cache(maxsize=16)  # 0.7 MB each in FAST
def _sums(lens: str, mode: Mode, plate_mm: float, distance_mm: float, power: int, gain: int) -> Sums:
    body = nominal(LENSES[lens])
    disparity = np.full((mode.rows, mode.cols), body.baseline_mm / (plate_mm + body.pupil_mm))
    pitch = pitch_at(disparity, body, mode, distance_mm)
    signal = np.full(pitch.shape, relative_exposure(distance_mm, power, gain))
    return quantise(np.where(in_window(pitch, body, mode) & (signal > 0), pitch, np.nan), signal)
