"""Find the geometry of a body and its lens from shots of flat things: bare plates, and boards with markers.

A bundle adjustment (Triggs, McLauchlan, Hartley and Fitzgibbon 1999) over the body and the pose of the plate in every
shot. The markers tell focal length, centre, distortion and scale, as in Zhang (2000); the range samples of the same
plane then tell baseline and stripe planes, and bare plates that the surface has to come out flat.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivers.scanner import SettingsError
from drivers.vivid900.bundle import PRIOR, STEP, Bundle, PlateShot, adjust, body_of, cost, unknowns_of
from drivers.vivid900.calibration import Calibration
from drivers.vivid900.lenses import TEXTURE_COLS, TEXTURE_ROWS
from drivers.vivid900.triangulation import points_along, sight_through
from restore.scan import Floats

MIN_SAMPLES = 100  # a plate that is hardly seen tells nothing
PROBES = 5  # points across the field at which the error to be expected is worked out


@dataclass(frozen=True)
class Calibrated:
    """A calibration, and how far to trust it.

    sigma       1σ of each unknown, under the names of PRIOR.
    markers_px  rms distance of the markers from where the calibration expects them, NaN without markers.
    lines       rms deviation of the samples from their plates, in lines of the CCD.
    expected_mm the largest 1σ, over the field and the distances of the shots, that the shots leave a point.
    """

    calibration: Calibration
    sigma: Mapping[str, float]
    markers_px: float
    lines: float
    expected_mm: float


def calibrate(shots: Sequence[PlateShot], start: Calibration) -> Calibrated:
    """Adjust a calibration, to begin with the manual's, to shots of plates.

    Raises SettingsError when there are no shots, or one shows too little of its plate.
    """
    if not shots:
        raise SettingsError("there are no shots to calibrate from", "shoot the board at several distances and tilts")
    if any(len(shot.pitch) < MIN_SAMPLES for shot in shots):
        raise SettingsError(
            "a shot shows next to nothing of its plate", "check its focus and exposure, or leave it out"
        )
    bundle = Bundle(tuple(shots), start)
    unknowns, normal = adjust(bundle)
    rest, count = bundle.residuals(unknowns), len(PRIOR)
    spread = max(cost(rest) / max(len(rest) - len(unknowns), 1), 1.0)
    covariance = np.asarray(np.linalg.inv(normal)[:count, :count] * spread)
    body = bundle.body(unknowns)
    lines, markers = bundle.misses(unknowns)
    return Calibrated(
        body,
        dict(zip(PRIOR, map(float, np.sqrt(np.diag(covariance))), strict=True)),
        float(np.sqrt(2 * (markers**2).mean())) if len(markers) else float("nan"),
        float(np.sqrt((lines**2).mean())),
        max(_expected_mm(body, covariance, shot) for shot in shots),
    )


def _expected_mm(body: Calibration, covariance: Floats, shot: PlateShot) -> float:
    """The largest 1σ (length of the error, mm) of points in focus over the field of a shot."""
    cols, rows = np.meshgrid(np.linspace(0, TEXTURE_COLS - 1, PROBES), np.linspace(0, TEXTURE_ROWS - 1, PROBES))
    pixels = np.stack([cols.ravel(), rows.ravel()], axis=1)
    pitch = pixels[:, 1] / shot.mode.step + (shot.mode.frames - 1) / 2

    def points(unknowns: Floats) -> Floats:
        probed = body_of(unknowns, body)
        return points_along(sight_through(probed, pixels), pitch, probed, shot.mode, shot.distance_mm)

    here = unknowns_of(body)
    steps = STEP * np.diag(list(PRIOR.values()))
    change = np.stack([(points(here + step) - points(here)) / step.sum() for step in steps], axis=-1)  # (n, 3, 13)
    variance = np.einsum("nik,kl,nil->n", change, covariance, change)
    return float(np.sqrt(variance.max()))
