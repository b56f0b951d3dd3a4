"""Bundle adjustment of a body and the poses of its calibration plates.

The unknowns are the body's, in the order of PRIOR, then a pose for each shot: 6 of a board, 3 of a bare plate.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from drivers.vivid900.geometry.calibration import Calibration
from drivers.vivid900.geometry.lenses import Mode
from drivers.vivid900.geometry.triangulation import lines_of_sight_through, points_along, project, stripe_tangent
from restore.scan import Floats

MARKER_PX = 0.05  # 1σ of a marker's centre
STRIPE_LINES = 0.04  # 1σ of a sample, between paper (0.02) and the faintest ink (0.07)
FRONT_MM = 0.3  # 1σ of a distance measured by hand from the front of the lens
OUTLIER_SIGMAS = 3.0  # beyond this the loss grows linearly, not quadratically
PER_METRE = 1000.0  # bare planes are parametrised in 1/m, so that unknowns are near one
IMAGE_AXES = np.diag([1.0, -1.0, -1.0])  # OpenCV's axes, y down and z forward, in the scanner's
DERIVATIVE_STEP = 1e-6  # finite-difference step, in units of each unknown's prior sigma
POSE_STEP = 1e-6  # relative finite-difference step of a pose unknown, at least of 0.001
MAX_ITERATIONS = 50  # twice what the worst initial guess needs
MAX_DAMPING = 1e8  # above this damping a step is below rounding: no descent is possible
COST_TOLERANCE = (
    1e-6  # relative decrease of the cost (a few thousand) below which no unknown moves by a hundredth of its sigma
)

PRIOR = {
    "baseline_mm": 5.0,
    "focal_px": 30.0,
    "centre_x": 10.0,
    "centre_y": 10.0,
    "pupil_mm": 3.0,
    "k1": 0.3,
    "k2": 1.0,
    "p0": 0.02,
    "p1": 0.03,
    "p2": 0.05,
    "p3": 0.05,
    "tilt": 0.01,
    "bow": 0.02,
}
"""Name of each unknown → 1σ by which bodies may differ from the manual's figures.

The baseline is read off a drawing to 5 mm; the others are a few per cent, far wider than the uncertainty that shots
leave.
"""


@dataclass(frozen=True, eq=False)
class PlateShot:
    """Measurements of one plane in one shot.

    texture_xy  (n, 2) texture pixels of samples on the plane, and their pitch (n,).
    pixels      (m, 2) texture pixels of marker centres, and their positions on_board (m, 2) mm; empty for a bare plate.
    front_mm    measured distance from the front of the lens to the plane along the axis, None when not measured.
    """

    texture_xy: Floats
    pitch: Floats
    mode: Mode
    distance_mm: float
    pixels: Floats = field(default_factory=lambda: np.empty((0, 2)))
    on_board: Floats = field(default_factory=lambda: np.empty((0, 2)))
    front_mm: float | None = None


@dataclass(frozen=True, eq=False)
class Bundle:
    """The residuals of all shots, in standard deviations: shot by shot, then the prior."""

    shots: tuple[PlateShot, ...]
    start: Calibration

    def body(self, unknowns: Floats) -> Calibration:
        """The calibration at unknowns (m,)."""
        return calibration_of_unknowns(unknowns[: len(PRIOR)], self.start)

    def initial_guess(self) -> Floats:
        """Return the start: its calibration, then the pose of the board per shot.

        Returns (m,) unknowns.
        """
        return np.concatenate(
            [unknowns_of_calibration(self.start), *(_initial_pose(shot, self.start) for shot in self.shots)]
        )

    def residuals(self, unknowns: Floats) -> Floats:
        """Compute the residuals (n,) at unknowns (m,)."""
        body = self.body(unknowns)
        rest = [_residuals(body, pose, shot) for pose, shot in zip(self._poses(unknowns), self.shots, strict=True)]
        return np.concatenate([*rest, self._prior(unknowns)])

    def jacobian(self, unknowns: Floats) -> Floats:
        """Compute the Jacobian (n, m); no shot depends on another's pose."""
        base, count = self.residuals(unknowns), len(PRIOR)
        jacobian = np.zeros((len(base), len(unknowns)))
        for k, spread in enumerate(PRIOR.values()):
            moved = unknowns.copy()
            moved[k] += DERIVATIVE_STEP * spread
            jacobian[:, k] = (self.residuals(moved) - base) / (DERIVATIVE_STEP * spread)
        body, row, col = self.body(unknowns), 0, count
        for pose, shot in zip(self._poses(unknowns), self.shots, strict=True):
            own = _residuals(body, pose, shot)
            for k in range(len(pose)):
                step = POSE_STEP * max(abs(pose[k]), 1e-3)
                moved = pose.copy()
                moved[k] += step
                jacobian[row : row + len(own), col + k] = (_residuals(body, moved, shot) - own) / step
            row, col = row + len(own), col + len(pose)
        return jacobian

    def line_and_reprojection_errors(self, unknowns: Floats) -> tuple[Floats, Floats]:
        """Compute line errors of the samples and reprojection errors.

        Returns (n,) in CCD lines, and (2m,) of the markers in pixels.
        """
        body, poses = self.body(unknowns), self._poses(unknowns)
        pairs = list(zip(poses, self.shots, strict=True))
        lines = np.concatenate([_line_errors(body, pose, shot) for pose, shot in pairs])
        return lines, np.concatenate([_reprojection_errors(body, pose, shot) for pose, shot in pairs])

    def _poses(self, unknowns: Floats) -> list[Floats]:
        sizes = [6 if len(shot.pixels) else 3 for shot in self.shots]
        return np.split(unknowns[len(PRIOR) :], np.cumsum(sizes)[:-1])

    def _prior(self, unknowns: Floats) -> Floats:
        return (unknowns[: len(PRIOR)] - unknowns_of_calibration(self.start)) / np.array(list(PRIOR.values()))


def unknowns_of_calibration(body: Calibration) -> Floats:
    """Return the values of a calibration in the order of PRIOR, (13,)."""
    return np.array(
        [body.baseline_mm, body.focal_px, *body.centre_px, body.pupil_mm]
        + [*body.distortion, *body.plane, body.tilt, body.bow]
    )


def calibration_of_unknowns(unknowns: Floats, like: Calibration) -> Calibration:
    """Return a calibration with these values and the rest of another one.

    unknowns: (13,) in the order of PRIOR.
    """
    baseline, focal, x, y, pupil, k1, k2, p0, p1, p2, p3, tilt, bow = map(float, unknowns)
    return replace(
        like,
        baseline_mm=baseline,
        focal_px=focal,
        centre_px=(x, y),
        pupil_mm=pupil,
        distortion=(k1, k2),
        plane=(p0, p1, p2, p3),
        tilt=tilt,
        bow=bow,
    )


def _initial_pose(shot: PlateShot, body: Calibration) -> Floats:
    """Return the initial pose of a board (PnP) or a bare plate (plane fit)."""
    if not len(shot.pixels):
        sight = lines_of_sight_through(body, shot.texture_xy)
        points = points_along(sight, shot.pitch, body, shot.mode, shot.distance_mm)
        terms = np.column_stack([sight.tangents, np.ones(len(points))])
        fit, *_ = np.linalg.lstsq(terms, -PER_METRE / points[:, 2], rcond=None)
        return np.asarray(fit)
    board = np.column_stack([shot.on_board, np.zeros(len(shot.on_board))])
    x, y = body.centre_px
    matrix = np.array([[body.focal_px, 0, x], [0, body.focal_px, y], [0, 0, 1]])
    _, turn, shift = cv2.solvePnP(board, shot.pixels, matrix, np.array([*body.distortion, 0.0, 0.0]))
    upright = Rotation.from_matrix(IMAGE_AXES) * Rotation.from_rotvec(turn[:, 0])
    return np.concatenate([upright.as_rotvec(), IMAGE_AXES @ shift[:, 0]])


def _plane(pose: Floats) -> Floats:
    """Return the plane of a pose in 1/depth = a·u + b·v + c, per mm.

    u and v are tangents of sight. Returns (a, b, c).
    """
    if len(pose) == 3:
        return pose / PER_METRE
    normal = Rotation.from_rotvec(pose[:3]).as_matrix()[:, 2]
    return np.asarray(normal * [1, 1, -1] / (normal @ pose[3:]))


def _residuals(body: Calibration, pose: Floats, shot: PlateShot) -> Floats:
    front = [] if shot.front_mm is None else [(1 / _plane(pose)[2] - body.pupil_mm - shot.front_mm) / FRONT_MM]
    return np.concatenate(
        [_line_errors(body, pose, shot) / STRIPE_LINES, _reprojection_errors(body, pose, shot) / MARKER_PX, front]
    )


def _line_errors(body: Calibration, pose: Floats, shot: PlateShot) -> Floats:
    """Compute measured minus predicted stripe positions (n,), CCD lines."""
    sight = lines_of_sight_through(body, shot.texture_xy)
    a, b, c = _plane(pose)
    disparity = body.baseline_mm * (sight.tangents @ [a, b] + c)
    seen = stripe_tangent(shot.pitch, body, shot.mode, shot.distance_mm) + sight.rise
    return np.asarray((seen - disparity) * body.focal_px)


def _reprojection_errors(body: Calibration, pose: Floats, shot: PlateShot) -> Floats:
    """Compute the reprojection errors (2m,) of the markers, pixels."""
    if not len(shot.pixels):
        return np.empty(0)
    board = np.column_stack([shot.on_board, np.zeros(len(shot.on_board))])
    points = Rotation.from_rotvec(pose[:3]).apply(board) + pose[3:]
    return np.asarray((shot.pixels - project(body, points)).ravel())


def adjust(bundle: Bundle) -> tuple[Floats, Floats]:
    """Minimise the pseudo-Huber cost of a bundle by reweighted Levenberg–Marquardt.

    SciPy's robust solver factors the whole Jacobian, thirty thousand rows, in every step. Returns the unknowns (m,) and
    the normal matrix (m, m) there.
    """
    unknowns, damping = bundle.initial_guess(), 1e-3
    rest = bundle.residuals(unknowns)
    for _ in range(MAX_ITERATIONS):
        weight = 1 / np.sqrt(1 + (rest / OUTLIER_SIGMAS) ** 2)
        jacobian = bundle.jacobian(unknowns)
        normal, gradient = jacobian.T @ (weight[:, None] * jacobian), jacobian.T @ (weight * rest)
        before = cost(rest)
        while damping < MAX_DAMPING:
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), gradient)
            rest = bundle.residuals(unknowns - step)
            if cost(rest) < before:
                break
            damping *= 10
        else:
            return unknowns, normal
        unknowns, damping = unknowns - step, damping / 10
        if before - cost(rest) < COST_TOLERANCE * before:
            return unknowns, normal
    return unknowns, normal


def cost(rest: Floats) -> float:
    """Sum of the pseudo-Huber loss of residuals (n,); r² for small residuals."""
    return float((2 * OUTLIER_SIGMAS**2 * (np.sqrt(1 + (rest / OUTLIER_SIGMAS) ** 2) - 1)).sum())
