"""Data of one release in the memory of the simulated scanner, as bytes to be read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivers.simulated.imaging.sensor import Sensor
from drivers.vivid900.capture.body import RANGE_MODES
from drivers.vivid900.capture.colour import ColourImage, Samples, build_colour
from drivers.vivid900.capture.pitch import Sums, build_pitch
from drivers.vivid900.profile.commands import AUTO_THRESHOLD, Parameters, ShotMode
from drivers.vivid900.profile.profile import Profile
from restore.scan import Bytes

LUMA = np.array([0.299, 0.587, 0.114])  # ITU-R BT.601: what a monitor shows of red, green and blue
CHANNELS = {ShotMode.RED: 0, ShotMode.GREEN: 1, ShotMode.BLUE: 2}


@dataclass(frozen=True)
class ShotData:
    """Data of the last capture.

    shot: its number, 0 before the first.
    swept: mode of the last sweep, the position of the motor, None before the first.
    mode, pitch, colour: of the capture; an image is empty where the mode has none.
    """

    shot: int = 0
    swept: ShotMode | None = None
    mode: ShotMode | None = None
    pitch: bytes = b""
    colour: bytes = b""


def read_out(sensor: Sensor, profile: Profile, parameters: Parameters, shot: int, swept: ShotMode | None) -> ShotData:
    """Data of a shot with the given parameters."""
    mode, pitch, colour = parameters.mode, b"", b""
    if mode.has_range:
        sums = sensor.sweep(RANGE_MODES[mode], parameters.distance_mm, parameters.laser_power, parameters.gain, shot)
        pitch = build_pitch(profile, _above(sums, parameters.threshold), shot)
    if not (mode.has_range and parameters.auto_read):
        colour = build_colour(profile, mode, ColourImage(_pixels(sensor.colour(shot), mode), shot))
    return ShotData(shot, swept, mode, pitch, colour)


def _above(sums: Sums, threshold: int) -> Sums:
    """The sums without samples darker than a threshold of the ten-bit converter."""
    if threshold == AUTO_THRESHOLD:
        return sums
    seen = sums.intensity >= threshold / 4
    return Sums(sums.sum * seen, sums.moment * seen, sums.intensity)


def _pixels(image: Bytes, mode: ShotMode) -> Samples:
    if mode is ShotMode.COLOUR_10:
        return image.astype(np.uint16) * 4
    if mode is ShotMode.MONITOR:
        return np.rint(image @ LUMA)[..., None].astype(np.uint8)
    if mode in CHANNELS:
        return image[..., [CHANNELS[mode]]]
    return image
