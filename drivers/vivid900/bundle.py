"""What the shots of a calibration say of its unknowns: residuals, their derivatives, and the adjustment.

The unknowns are the body's, in the order of PRIOR, then a pose for each shot: 6 of a board, 3 of a bare plate.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from drivers.vivid900.calibration import Calibration
from drivers.vivid900.lenses import Mode
from drivers.vivid900.triangulation import points_along, project, sight_through, stripe_tangent
from restore.scan import Floats

MARKER_PX = 0.05  # 1σ of a marker's middle
STRIPE_LINES = 0.04  # 1σ of a sample, between paper (0.02) and the faintest ink (0.07)
FRONT_MM = 0.3  # 1σ of a distance measured by hand from the front of the lens
OUTLIER_SIGMAS = 3.0  # from here on a residual counts linearly, not squared
PER_METRE = 1000.0  # bare planes are held in 1/m: unknowns near one
IMAGE_AXES = np.diag([1.0, -1.0, -1.0])  # OpenCV's axes, y down and z forward, in the scanner's
STEP = 1e-6  # of each unknown's prior spread, for its numeric derivative
POSE_STEP = 1e-6  # of each pose unknown, or of a thousandth where it is smaller
MOST_STEPS = 50  # twice what the worst start needs
STUCK = 1e8  # damping at which a step is shorter than rounding
SETTLED = 1e-6  # relative fall of the cost, a few thousand, that moves nothing by a hundredth of its sigma

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
"""Name of each unknown → 1σ by which bodies may differ from the manual's figures: the baseline is read off a drawing
to 5 mm; the others are a few per cent, far wider than what shots leave open."""


@dataclass(frozen=True, eq=False)
class PlateShot:
    """What one shot saw of a plane.

    texture_xy  (n, 2) texture pixels of samples on the plane, and their pitch (n,).
    pixels      (m, 2) texture pixels of markers, and their places on_board (m, 2) mm; none on a bare plate.
    front_mm    distance from the front of the lens to the plane along the axis, where it was measured.
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
        return body_of(unknowns[: len(PRIOR)], self.start)

    def first_guess(self) -> Floats:
        return np.concatenate([unknowns_of(self.start), *(_first_pose(shot, self.start) for shot in self.shots)])

    def residuals(self, unknowns: Floats) -> Floats:
        """(n,) at unknowns (m,)."""
        body = self.body(unknowns)
        rest = [_residuals(body, pose, shot) for pose, shot in zip(self._poses(unknowns), self.shots, strict=True)]
        return np.concatenate([*rest, self._prior(unknowns)])

    def jacobian(self, unknowns: Floats) -> Floats:
        """(n, m); no shot depends on the pose of another."""
        base, count = self.residuals(unknowns), len(PRIOR)
        jacobian = np.zeros((len(base), len(unknowns)))
        for k, spread in enumerate(PRIOR.values()):
            moved = unknowns.copy()
            moved[k] += STEP * spread
            jacobian[:, k] = (self.residuals(moved) - base) / (STEP * spread)
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

    def misses(self, unknowns: Floats) -> tuple[Floats, Floats]:
        """Lines by which samples, and pixels by which markers (both axes) miss."""
        body, poses = self.body(unknowns), self._poses(unknowns)
        pairs = list(zip(poses, self.shots, strict=True))
        lines = np.concatenate([_lines(body, pose, shot) for pose, shot in pairs])
        return lines, np.concatenate([_markers(body, pose, shot) for pose, shot in pairs])

    def _poses(self, unknowns: Floats) -> list[Floats]:
        sizes = [6 if len(shot.pixels) else 3 for shot in self.shots]
        return np.split(unknowns[len(PRIOR) :], np.cumsum(sizes)[:-1])

    def _prior(self, unknowns: Floats) -> Floats:
        return (unknowns[: len(PRIOR)] - unknowns_of(self.start)) / np.array(list(PRIOR.values()))


def unknowns_of(body: Calibration) -> Floats:
    return np.array(
        [body.baseline_mm, body.focal_px, *body.centre_px, body.pupil_mm]
        + [*body.distortion, *body.plane, body.tilt, body.bow]
    )


def body_of(unknowns: Floats, like: Calibration) -> Calibration:
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


def _first_pose(shot: PlateShot, body: Calibration) -> Floats:
    """A pose to begin with: of a board from its markers, of a bare plate from its samples."""
    if not len(shot.pixels):
        sight = sight_through(body, shot.texture_xy)
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
    """(a, b, c) of the plane on which 1/depth = a·u + b·v + c, per mm, in tangents (u, v) of sight."""
    if len(pose) == 3:
        return pose / PER_METRE
    normal = Rotation.from_rotvec(pose[:3]).as_matrix()[:, 2]
    return np.asarray(normal * [1, 1, -1] / (normal @ pose[3:]))


def _residuals(body: Calibration, pose: Floats, shot: PlateShot) -> Floats:
    front = [] if shot.front_mm is None else [(1 / _plane(pose)[2] - body.pupil_mm - shot.front_mm) / FRONT_MM]
    return np.concatenate([_lines(body, pose, shot) / STRIPE_LINES, _markers(body, pose, shot) / MARKER_PX, front])


def _lines(body: Calibration, pose: Floats, shot: PlateShot) -> Floats:
    """(n,) lines by which the stripe was seen above where the plane would show it."""
    sight = sight_through(body, shot.texture_xy)
    a, b, c = _plane(pose)
    disparity = body.baseline_mm * (sight.tangents @ [a, b] + c)
    seen = stripe_tangent(shot.pitch, body, shot.mode, shot.distance_mm) + sight.rise
    return np.asarray((seen - disparity) * body.focal_px)


def _markers(body: Calibration, pose: Floats, shot: PlateShot) -> Floats:
    """(2m,) pixels by which the markers were seen off their places."""
    if not len(shot.pixels):
        return np.empty(0)
    board = np.column_stack([shot.on_board, np.zeros(len(shot.on_board))])
    points = Rotation.from_rotvec(pose[:3]).apply(board) + pose[3:]
    return np.asarray((shot.pixels - project(body, points)).ravel())


def adjust(bundle: Bundle) -> tuple[Floats, Floats]:
    """The unknowns (m,) that fit best, and the normal matrix (m, m) there.

    Levenberg–Marquardt on the normal equations, reweighted for the pseudo-Huber loss. SciPy's robust solver decomposes
    the whole Jacobian, thirty thousand rows, in every step.
    """
    unknowns, damping = bundle.first_guess(), 1e-3
    rest = bundle.residuals(unknowns)
    for _ in range(MOST_STEPS):
        weight = 1 / np.sqrt(1 + (rest / OUTLIER_SIGMAS) ** 2)
        jacobian = bundle.jacobian(unknowns)
        normal, gradient = jacobian.T @ (weight[:, None] * jacobian), jacobian.T @ (weight * rest)
        before = cost(rest)
        while damping < STUCK:
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), gradient)
            rest = bundle.residuals(unknowns - step)
            if cost(rest) < before:
                break
            damping *= 10
        else:
            return unknowns, normal
        unknowns, damping = unknowns - step, damping / 10
        if before - cost(rest) < SETTLED * before:
            return unknowns, normal
    return unknowns, normal


def cost(rest: Floats) -> float:
    """Sum of the pseudo-Huber loss of residuals (n,): r² for small ones."""
    return float((2 * OUTLIER_SIGMAS**2 * (np.sqrt(1 + (rest / OUTLIER_SIGMAS) ** 2) - 1)).sum())
