"""Optical constants of the Vivid 900 and 910.

The camera looks along −Z from the origin; the galvano mirror that sweeps the horizontal laser stripe stands BASELINE_MM
below it. The geometry that follows from them is in `triangulation`.

Source of every number, unless said otherwise: VIVID 910 hardware manual (Minolta 9222-1888-19), pages as given.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from restore.scan import Floats
from restore.vivid import FOCAL_PX

BASELINE_MM = 250.0
"""Lens axis down to the axis of the galvano mirror, ±5 mm.

Read off the dimension drawing (p. 58).
"""

REFERENCE_MM = 600.0
"""The distance at which the manual states precision and smallest depth range (p. 56)."""


@dataclass(frozen=True)
class Lens:
    """One of the three exchangeable lenses.

    focal_px      focal length in texture pixels.
    pupil_mm      distance of the entrance pupil behind the front of the lens, from the straight line through the
                  fields of view of p. 26.
    depth_mm      depth that one FINE shot covers at REFERENCE_MM: the lower end of the Z range (p. 56).
    precision_mm  standard deviation of z on white paper at REFERENCE_MM (p. 56).
    """

    name: str
    focal_px: float
    pupil_mm: float
    depth_mm: float
    precision_mm: float

    def line_mm(self, distance_mm: float) -> float:
        """Depth per CCD line, mm, at a distance from the front of the lens: depth² / (f·b)."""
        return (distance_mm + self.pupil_mm) ** 2 / (self.focal_px * BASELINE_MM)

    @property
    def usable_lines(self) -> float:
        """Return how many lines of the 125-line block carry depth.

        The others are taken up by the width of the stripe.
        """
        return self.depth_mm / self.line_mm(REFERENCE_MM)

    def lines(self, mode: Mode) -> float:
        """Lines of a mode's block that carry depth."""
        return self.usable_lines * mode.block_lines / FINE.block_lines

    @property
    def line_noise(self) -> float:
        """Return the standard deviation of the stripe's position, CCD lines.

        On white paper; close to 0.02 for every lens.
        """
        return self.precision_mm / self.line_mm(REFERENCE_MM)


LENSES = {
    lens.name: lens
    for lens in (
        Lens("TELE", focal_px=FOCAL_PX["TELE"], pupil_mm=14.9, depth_mm=40.0, precision_mm=0.008),
        Lens("MIDDLE", focal_px=FOCAL_PX["MIDDLE"], pupil_mm=21.5, depth_mm=70.0, precision_mm=0.016),
        Lens("WIDE", focal_px=FOCAL_PX["WIDE"], pupil_mm=13.7, depth_mm=110.0, precision_mm=0.032),
    )
}


@dataclass(frozen=True)
class Mode:
    """Scan mode: samples, their spacing, and the CCD lines read per frame.

    The spacing is in texture pixels (p. 59).
    """

    name: str
    rows: int
    cols: int
    step: int
    block_lines: int
    seconds: float

    @property
    def frames(self) -> int:
        """Return the number of frames during which a sample is in the block.

        The block moves on by `step` lines with each.
        """
        return self.block_lines // self.step


FINE = Mode("fine", rows=480, cols=640, step=1, block_lines=125, seconds=2.5)
# The FAST block is 36 rows of two lines each: 480 + 72 lines at 2 lines a frame take 276 frames, and the manual counts
# about 270; for FINE the same sum gives 605 frames, and it counts about 600.
FAST = Mode("fast", rows=240, cols=320, step=2, block_lines=72, seconds=0.3)
MODES = {mode.name: mode for mode in (FINE, FAST)}


def texture_grid(mode: Mode) -> Floats:
    """Return the texture pixel (x, y) of every sample, (rows, cols, 2).

    In FINE it is the sample's own pixel, in FAST the centre of four.
    """
    row, col = np.mgrid[: mode.rows, : mode.cols].astype(float)
    return np.stack([col, row], axis=-1) * mode.step + (mode.step - 1) / 2


def depth_window(lens: Lens, mode: Mode, distance_mm: float) -> tuple[float, float]:
    """Return the depths that one shot focused at `distance_mm` can measure.

    The stripe must fall on the block of lines that is read out around the line where it lies at the reference distance,
    which bounds 1/depth.
    Returns (near, far), mm from the lens centre.
    """
    centre, half = 1 / (distance_mm + lens.pupil_mm), lens.lines(mode) / 2 / (lens.focal_px * BASELINE_MM)
    return 1 / (centre + half), 1 / max(centre - half, np.finfo(float).tiny)
