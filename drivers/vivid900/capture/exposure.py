"""Laser power, gain and focus chosen from a preview shot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivers.vivid900.profile.commands import Parameters
from drivers.vivid900.settings import MAX_DISTANCE_MM, MAX_GAIN, MAX_LASER_POWER, MIN_DISTANCE_MM
from restore.scan import Bytes, Floats

PAPER_LEVEL = 64  # intensity of white paper, of 255: two stops below saturation, as headroom for gloss
WHITE_PERCENTILE = 90  # most of a page is paper; the brightest tenth may be gloss
DARK_LEVEL = 4  # below this there is only noise
SATURATED = 255
GAIN_STEP = 2**0.5  # brightness from one CCD gain to the next; the manual names the steps, not their size
MIN_MEASURED_FRACTION = 0.01  # fraction of the samples that a preview must have measured to be used
DEPTH_PERCENTILES = (2, 98)  # percentiles of depth whose middle is the page's: values beyond may be outliers


def brightness(intensity: Bytes) -> float:
    """Return the intensity of white paper in a shot.

    intensity: (rows, cols), 0 to 255. Returns 0 when too few samples are lit.
    """
    lit = intensity[intensity >= DARK_LEVEL]
    return float(np.percentile(lit, WHITE_PERCENTILE)) if lit.size > MIN_MEASURED_FRACTION * intensity.size else 0.0


def corrected_exposure(parameters: Parameters, level: float, *, gain_is_fixed: bool = False) -> Parameters:
    """Compute laser power and gain that bring white paper to PAPER_LEVEL.

    level: of white paper at the present exposure. The power is changed first, the gain for the rest.
    """
    if level >= SATURATED:
        ratio = 1 / 8  # saturated: by how much is unknown
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


def centring_distance(points: Floats, pupil_mm: float) -> float | None:
    """Return the focus distance that centres points in the depth window.

    points: (rows, cols, 3). Returns mm from the front of the lens, None when there are too few points. The window is
        symmetric in 1/depth.
    """
    depth = -points[..., 2]
    seen = depth[np.isfinite(depth)]
    if seen.size <= MIN_MEASURED_FRACTION * depth.size:
        return None
    near, far = np.percentile(seen, DEPTH_PERCENTILES)
    return float(np.clip(2 / (1 / near + 1 / far) - pupil_mm, MIN_DISTANCE_MM, MAX_DISTANCE_MM))


def is_well_exposed(level: float) -> bool:
    """Whether white paper lies within half a stop of PAPER_LEVEL."""
    return PAPER_LEVEL / GAIN_STEP <= level <= PAPER_LEVEL * GAIN_STEP
