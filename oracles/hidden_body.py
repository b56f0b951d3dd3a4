"""A scanner's body whose geometry the driver is not told, for calibrations to recover."""

from __future__ import annotations

from dataclasses import replace

from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import LENSES

NOMINAL = nominal(LENSES["MIDDLE"])
HIDDEN_BODY = replace(
    NOMINAL,
    baseline_mm=251.3,
    focal_px=1930.2,
    centre_px=(323.1, 236.4),
    pupil_mm=22.4,
    distortion=(-0.07, 0.08),
    plane=(1.1e-3, -4e-3, 2e-3, 1e-3),
    tilt=8e-4,
    bow=1.5e-3,
)
"""A body as bodies may be: half a per cent off in most things, and a lens that bends the corners by 1.1 pixels."""
