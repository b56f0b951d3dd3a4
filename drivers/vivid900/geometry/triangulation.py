"""Triangulation from the pitch to points in space, and back.

The pitch is the frame at which the stripe crossed a pixel.

The pitch of a sample is the frame, counted from 0 at the start of the sweep and with fractions, at which the stripe
crossed its pixel: the temporal centre of gravity of the light (VIVID 910 hardware manual p. 57; US 6,151,118).

    The block that is read out moves down by `step` lines with every frame, so row r of the samples is in it during the
    frames r, r + 1, … r + n − 1 with n = block_lines / step: 125 for FINE, 36 for FAST. With the light x_j that the
    sample gathers in the j-th of these, pitch = r + Σ j·x_j / Σ x_j.

    The mirror is driven so that at the distance in focus the stripe keeps to the middle of the block. For a sample
    of pitch f the mirror was therefore commanded to the tangent s(f) = t(f − (n − 1)/2) + baseline/(distance + pupil),
    t(r) being the vertical tangent of row r's line of sight; baseline, focal length and pupil are the manual's nominal
    figures here, and the deviations of the body are its calibration. That the drive is linear in the tangent and not in
    the angle is our assumption; the cubic of the calibration absorbs the difference at any one distance.

A direction of sight is the tangents (u right, v up) = (x, y) / depth. The stripe plane of tangent T meets it where y +
baseline = depth·(T + tilt·u + bow·u²), hence depth = baseline / (T + tilt·u + bow·u² − v).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from drivers.vivid900.geometry.calibration import Calibration
from drivers.vivid900.geometry.lenses import BASELINE_MM, LENSES, Mode, texture_grid
from restore.scan import Floats, Mask
from restore.vivid import TEXTURE_ROWS

# Newton's method doubles the correct digits with every step; the initial guess is within a twentieth.
NEWTON_STEPS = 5


@dataclass(frozen=True, eq=False)
class LinesOfSight:
    """Lines of sight.

    tangents  (…, 2) tangents right and up.
    rise      (…) height of the stripe plane above its tangent T, minus v, at the line of sight.
    """

    tangents: Floats
    rise: Floats


def points_of(pitch: Floats, calibration: Calibration, mode: Mode, distance_mm: float) -> Floats:
    """Return the points of a pitch image.

    pitch: (rows, cols) frames.
    distance_mm: from the front of the lens, at which the shot was focused.
    Returns (rows, cols, 3) mm in the scanner's frame, NaN where the pitch is NaN or meets nothing in front.
    """
    return points_along(lines_of_sight(calibration, mode), pitch, calibration, mode, distance_mm)


def points_along(
    sight: LinesOfSight, pitch: Floats, calibration: Calibration, mode: Mode, distance_mm: float
) -> Floats:
    """Return the points of `points_of` for any lines of sight.

    sight: (…) of the calibration. Returns (…, 3) mm.
    """
    denominator = stripe_tangent(pitch, calibration, mode, distance_mm) + sight.rise
    denominator[~(denominator > 0)] = np.nan
    depth = np.divide(calibration.baseline_mm, denominator, out=denominator)
    points = np.empty((*pitch.shape, 3))
    np.multiply(sight.tangents, depth[..., None], out=points[..., :2])
    np.negative(depth, out=points[..., 2])
    return points


def pitch_of(points: Floats, calibration: Calibration, mode: Mode, distance_mm: float) -> Floats:
    """Return the pitch of a grid of points, the inverse of `points_of`.

    points: (rows, cols, 3) mm. Returns (rows, cols).
    """
    return pitch_at(calibration.baseline_mm / -points[..., 2], calibration, mode, distance_mm)


def pitch_at(disparity: Floats, calibration: Calibration, mode: Mode, distance_mm: float) -> Floats:
    """Return the pitch of samples of a disparity, baseline / depth.

    disparity: (rows, cols). Returns (rows, cols).
    """
    first, slope = _drive(calibration, mode, distance_mm)
    wanted = disparity - lines_of_sight(calibration, mode).rise
    cubic = _cubic(calibration)
    sent = wanted.copy()
    for _ in range(NEWTON_STEPS):
        sent -= (np.polyval(cubic, sent) - wanted) / np.polyval(np.polyder(cubic), sent)
    return (sent - first) / slope


def stripe_tangent(pitch: Floats, calibration: Calibration, mode: Mode, distance_mm: float) -> Floats:
    """Return the tangent T (…) of the stripe plane at pitch (…)."""
    first, slope = _drive(calibration, mode, distance_mm)
    sent, (leading, *others) = first + slope * pitch, _cubic(calibration)
    tangent = np.full_like(sent, leading)
    for coefficient in others:  # Horner's scheme in place: half the time of `np.polyval`
        tangent *= sent
        tangent += coefficient
    return tangent


def in_window(pitch: Floats, calibration: Calibration, mode: Mode) -> Mask:
    """Return where the stripe is on lines that carry depth.

    Returns (rows, cols) bool.
    """
    lens = LENSES[calibration.lens]
    row = np.arange(mode.rows)[:, None]
    off_centre = pitch - row - (mode.frames - 1) / 2
    return np.asarray(np.abs(off_centre) * mode.step < lens.lines(mode) / 2)


@lru_cache(maxsize=4)  # 7 MB each; a station has a lens or two and two modes
def lines_of_sight(calibration: Calibration, mode: Mode) -> LinesOfSight:
    """Return the lines of sight of the samples of a mode.

    They are cached, because successive shots use the same lens.
    """
    return lines_of_sight_through(calibration, texture_grid(mode))


def lines_of_sight_through(calibration: Calibration, texture_xy: Floats) -> LinesOfSight:
    """The lines of sight through texture pixels (…, 2)."""
    sight = tangents(calibration, texture_xy)
    u, v = sight[..., 0], sight[..., 1]
    return LinesOfSight(sight, calibration.tilt * u + calibration.bow * u**2 - v)


def tangents(calibration: Calibration, texture_xy: Floats) -> Floats:
    """Return the tangents (right, up) of sight through texture pixels.

    texture_xy: (…, 2). Returns (…, 2).
    """
    distorted = (texture_xy - np.array(calibration.centre_px)) * np.array([1.0, -1.0]) / calibration.focal_px
    target = np.linalg.norm(distorted, axis=-1)
    k1, k2 = calibration.distortion
    radius = target.copy()
    for _ in range(NEWTON_STEPS):
        squared = radius**2
        excess = radius * (1 + squared * (k1 + k2 * squared)) - target
        radius -= excess / (1 + squared * (3 * k1 + 5 * k2 * squared))
    return distorted / _stretch(calibration, radius**2)[..., None]


def project(calibration: Calibration, points: Floats) -> Floats:
    """Project points in the scanner's frame to texture pixels (x, y).

    points: (…, 3) mm. Returns (…, 2).
    """
    ideal = points[..., :2] / -points[..., 2:]
    seen = ideal * _stretch(calibration, (ideal**2).sum(axis=-1))[..., None]
    return np.asarray(calibration.centre_px + seen * np.array([1.0, -1.0]) * calibration.focal_px)


def _stretch(calibration: Calibration, squared_radius: Floats) -> Floats:
    k1, k2 = calibration.distortion
    return np.asarray(1 + squared_radius * (k1 + k2 * squared_radius))


def _drive(calibration: Calibration, mode: Mode, distance_mm: float) -> tuple[float, float]:
    """Return the commanded mirror tangent s, linear in the frame.

    Returns (s(0), s(1) − s(0)).
    """
    lens = LENSES[calibration.lens]
    slope = -mode.step / lens.focal_px
    first_row = ((TEXTURE_ROWS - 1) / 2 - (mode.step - 1) / 2) / lens.focal_px
    in_focus = BASELINE_MM / (distance_mm + lens.pupil_mm)
    return first_row - slope * (mode.frames - 1) / 2 + in_focus, slope


def _cubic(calibration: Calibration) -> Floats:
    """Return the stripe plane's tangent as a cubic of the commanded one.

    Returns (4,) from the highest power.
    """
    p0, p1, p2, p3 = calibration.plane
    return np.array([p3, p2, 1 + p1, p0])
