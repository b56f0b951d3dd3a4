"""Geometry calibration of a body and lens from shots of planes.

The planes are bare plates, and boards with markers.
A bundle adjustment (Triggs, McLauchlan, Hartley and Fitzgibbon 1999) over the body and the pose of the plate in every
shot. The markers determine focal length, principal point, distortion and scale, as in Zhang (2000); the range samples
of the same plane determine baseline and stripe planes, and bare plates constrain the surface to be flat.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from math import isnan

import numpy as np

from drivers.scanner import SettingsError
from drivers.vivid900.calibrating.bundle_adjustment import (
    DERIVATIVE_STEP,
    PRIOR,
    Bundle,
    PlateShot,
    adjust,
    calibration_of_unknowns,
    cost,
    unknowns_of_calibration,
)
from drivers.vivid900.geometry.calibration import Calibration, Measurement
from drivers.vivid900.geometry.triangulation import lines_of_sight_through, points_along
from restore.scan import Floats
from restore.vivid import TEXTURE_COLS, TEXTURE_ROWS

MIN_SAMPLES = 100  # fewer samples do not constrain the calibration
PROBES = 5  # points across the field at which the expected error is evaluated


@dataclass(frozen=True)
class CalibrationResult:
    """A calibration and its uncertainty.

    sigma       1σ of each unknown, under the names of PRIOR.
    markers_px  rms reprojection error of the markers, pixels, NaN without markers.
    lines       rms residual of the samples from their planes, CCD lines.
    expected_mm largest 1σ of a point, mm, over the field and the distances of the shots.
    expected_length  largest 1σ of the distance of two points there, as a fraction of it: it does not count that the
                scene as a whole is turned or moved, which is most of the error of a point.
    """

    calibration: Calibration
    sigma: Mapping[str, float]
    markers_px: float
    lines: float
    expected_mm: float
    expected_length: float


def calibrate(shots: Sequence[PlateShot], start: Calibration) -> CalibrationResult:
    """Fit a calibration to shots of plates, starting from another.

    start: for the first time the manual's figures.
    Raises SettingsError for an empty list of shots, or when one has too few samples of its plate.
    """
    if not shots:
        raise SettingsError(
            "no captures were given to calibrate from", "capture the board at several distances and tilts"
        )
    if any(len(shot.pitch) < MIN_SAMPLES for shot in shots):
        raise SettingsError(
            "a capture shows next to nothing of its plate", "check its focus and exposure, or leave it out"
        )
    bundle = Bundle(tuple(shots), start)
    unknowns, normal = adjust(bundle)
    rest, count = bundle.residuals(unknowns), len(PRIOR)
    spread = max(cost(rest) / max(len(rest) - len(unknowns), 1), 1.0)
    covariance = np.asarray(np.linalg.inv(normal)[:count, :count] * spread)
    body = bundle.body(unknowns)
    lines, markers = bundle.line_and_reprojection_errors(unknowns)
    expected = [_expected_errors(body, covariance, shot) for shot in shots]
    return CalibrationResult(
        body,
        dict(zip(PRIOR, map(float, np.sqrt(np.diag(covariance))), strict=True)),
        float(np.sqrt(2 * (markers**2).mean())) if len(markers) else float("nan"),
        float(np.sqrt((lines**2).mean())),
        max(of_point for of_point, _ in expected),
        max(of_length for _, of_length in expected),
    )


def with_measurement(result: CalibrationResult, captures: int, day: date) -> CalibrationResult:
    """Return the result with a calibration that records how it was measured."""
    markers = None if isnan(result.markers_px) else result.markers_px
    expected = result.expected_mm, result.expected_length
    measured = Measurement(day.isoformat(), captures, result.lines, expected[0], markers, expected[1])
    return replace(result, calibration=replace(result.calibration, measured=measured))


def _expected_errors(body: Calibration, covariance: Floats, shot: PlateShot) -> tuple[float, float]:
    """Return the largest 1σ of points over the field of a shot, and of distances.

    Of points in focus in mm; of the distances in the depth window that a page of less than 45° joins, as a fraction.
    """
    cols, rows = np.linspace(0, TEXTURE_COLS - 1, PROBES), np.linspace(0, TEXTURE_ROWS - 1, PROBES)
    middle = (shot.mode.frames - 1) / 2  # of the depth window, frames
    x, y, off_focus = (axis.ravel() for axis in np.meshgrid(cols, rows, (-middle, 0.0, middle)))
    pixels, pitch = np.stack([x, y], axis=1), y / shot.mode.step + middle + off_focus

    def points(unknowns: Floats) -> Floats:
        probed = calibration_of_unknowns(unknowns, body)
        return points_along(lines_of_sight_through(probed, pixels), pitch, probed, shot.mode, shot.distance_mm)

    here = unknowns_of_calibration(body)
    steps = DERIVATIVE_STEP * np.diag(list(PRIOR.values()))
    change = np.stack([(points(here + step) - points(here)) / step.sum() for step in steps], axis=-1)  # (n, 3, 13)
    in_focus = change[off_focus == 0.0]
    of_points = np.einsum("nik,kl,nil->n", in_focus, covariance, in_focus)
    start, end = np.triu_indices(len(pixels), 1)
    apart = points(here)[end] - points(here)[start]
    length = np.linalg.norm(apart, axis=1)
    across = np.hypot(apart[:, 0], apart[:, 1]) > np.abs(apart[:, 2])
    longer = np.einsum("ni,nik->nk", apart, change[end] - change[start]) / length[:, None] ** 2
    of_lengths = np.einsum("nk,kl,nl->n", longer, covariance, longer)[across]
    return float(np.sqrt(of_points.max())), float(np.sqrt(of_lengths.max()))
