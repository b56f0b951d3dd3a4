"""Laser power, gain and focus chosen from a preview shot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivers.scanner import MAX_DISTANCE_MM, MAX_GAIN, MAX_LASER_POWER, MIN_DISTANCE_MM
from drivers.vivid900.commands import Parameters
from drivers.vivid900.pitch import Pitch
from restore.scan import Floats

PAPER_LEVEL = 64  # intensity of white paper, of 255: two stops below saturation, so that gloss has room
WHITE_PERCENTILE = 90  # most of a page is paper: the brightest tenth is left to gloss
DARK_LEVEL = 4  # below this, noise; a preview that saw no more than that says nothing
SATURATED = 255
GAIN_STEP = 2**0.5  # brightness from one CCD gain to the next; the manual names the steps, not their size
LEAST_SEEN = 0.01  # share of the samples that a preview must see to choose from it
SPREAD = (2, 98)  # percentiles of depth that the middle of the page is taken from: the rest may be strays


def brightness(pitch: Pitch) -> float:
    """Intensity of white paper in a shot, 0 to 255; 0 when there is too little light to tell."""
    lit = pitch.intensity[pitch.intensity >= DARK_LEVEL]
    return float(np.percentile(lit, WHITE_PERCENTILE)) if lit.size > LEAST_SEEN * pitch.intensity.size else 0.0


def expose(parameters: Parameters, level: float, *, gain_is_fixed: bool = False) -> Parameters:
    """Laser power and gain that bring white paper from `level` to PAPER_LEVEL: power first, gain for what is left."""
    if level >= SATURATED:
        ratio = 1 / 8  # it may be any number of stops too bright
    elif level <= 0:
        ratio = 8.0
    else:
        ratio = PAPER_LEVEL / level
    gain = parameters.gain if gain_is_fixed else 0
    wanted = parameters.laser_power * ratio * GAIN_STEP ** (parameters.gain - gain)
    power = int(np.clip(round(wanted), 1, MAX_LASER_POWER))
    if not gain_is_fixed:
        gain = int(np.clip(round(float(np.log(wanted / power) / np.log(GAIN_STEP))), 0, MAX_GAIN))
    return replace(parameters, laser_power=power, gain=gain)


def middle_of(points: Floats, pupil_mm: float) -> float | None:
    """Distance from the front of the lens, mm, that puts points (rows, cols, 3) mm in the middle of the depth window.

    The window is even in 1/depth. None when there are too few points to tell.
    """
    depth = -points[..., 2]
    seen = depth[np.isfinite(depth)]
    if seen.size <= LEAST_SEEN * depth.size:
        return None
    near, far = np.percentile(seen, SPREAD)
    return float(np.clip(2 / (1 / near + 1 / far) - pupil_mm, MIN_DISTANCE_MM, MAX_DISTANCE_MM))


def is_well_exposed(level: float) -> bool:
    """Whether white paper lies within half a stop of PAPER_LEVEL."""
    return PAPER_LEVEL / GAIN_STEP <= level <= PAPER_LEVEL * GAIN_STEP
