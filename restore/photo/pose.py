"""Pose of the camera, and then its lens, from matches.

The pose is robust: the focal length is unknown, so it is sought for a ladder of focal lengths, with wrong matches among
the right ones (Fischler & Bolles 1981), and the best is refined together with focal length and distortion.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from restore.camera.photo_camera import PARAMETERS, PhotoCamera, project_with_jacobian
from restore.scan import Floats, Mask

LADDER = tuple(0.6 * 1.3**k for k in range(9))  # of the longer side: 80° to 12° of view; phones 0.75, telephotos 4
LOOSE = 0.012  # of the longer side: distortion that the first pose does not know yet
TRIES = 400  # with a third of the matches right, four right ones are drawn with certainty
CONFIDENCE = 0.999
MIN_POINTS = 6
# Prior knowledge of lenses, as standard deviations: principal point in fractions of the diagonal,
# then k1, k2, p1, p2, k3 of lenses other than fisheyes.
CENTRE_SPREAD = 0.01
DISTORTION_SPREAD = np.array([0.15, 0.15, 0.003, 0.003, 0.05])
FOCAL_SPREAD = 1.0  # of its logarithm, when nothing is known
FREE_STRAIGHT = 7  # of the parameters: pose and focal length
REWEIGHTINGS = 3
CAUCHY = 2.0  # sigmas: an error of that size counts half


def find_pose(
    points: Floats, pixels: Floats, size: tuple[int, int], focals: Sequence[float]
) -> tuple[PhotoCamera, Mask]:
    """Find the camera that sees most surface points at their pixels.

    The camera has no distortion yet; all matches may be wrong.
    points: (n, 3) mm.
    pixels: (n, 2).
    focals: lengths in pixels to be tried.
    Returns the camera and which points those are.
    """
    centre = (np.array(size) - 1) / 2
    best = PhotoCamera(_vector(np.zeros(3), np.array([0, 0, 1.0]), focals[0], centre), size)
    inliers = np.zeros(len(points), bool)
    if len(points) < MIN_POINTS:
        return best, inliers
    for focal in focals:
        camera = _ransac(points, pixels, size, focal)
        if camera is None:
            continue
        near = reprojection_errors(camera, points, pixels) < LOOSE * max(size)
        if near.sum() > inliers.sum():
            best, inliers = camera, near
    return best, inliers


def _ransac(points: Floats, pixels: Floats, size: tuple[int, int], focal: float) -> PhotoCamera | None:
    centre = (np.array(size) - 1) / 2
    matrix = np.array([[focal, 0, centre[0]], [0, focal, centre[1]], [0, 0, 1.0]])
    cv2.setRNGSeed(0)
    try:
        found, turn, shift, _ = cv2.solvePnPRansac(
            points,
            pixels,
            matrix,
            None,
            iterationsCount=TRIES,
            reprojectionError=LOOSE * max(size),
            confidence=CONFIDENCE,
            flags=cv2.SOLVEPNP_AP3P,
        )
    except cv2.error:  # raised when the drawn points lie so that no pose follows from them
        return None
    return PhotoCamera(_vector(turn.ravel(), shift.ravel(), focal, centre), size) if found else None


def _vector(turn: Floats, shift: Floats, focal: float, centre: Floats) -> Floats:
    return np.concatenate([turn, shift, [focal], centre, np.zeros(5)])


def reprojection_errors(camera: PhotoCamera, points: Floats, pixels: Floats) -> Floats:
    """Return reprojection errors (n,) in pixels, infinite where not seen.

    points: (n, 3) mm.
    pixels: (n, 2).
    """
    distance = np.linalg.norm(camera.project(points) - pixels, axis=1)
    return np.where(np.isfinite(distance), distance, np.inf)


def refine(
    camera: PhotoCamera,
    points: Floats,
    pixels: Floats,
    noise_px: float,
    *,
    focal_px: float | None = None,
    focal_spread: float = FOCAL_SPREAD,
    straight: bool = False,
) -> PhotoCamera:
    """Adjust pose and lens to points seen at pixels.

    points: (n, 3) mm.
    pixels: (n, 2).
    noise_px: standard deviation of a good pixel; larger errors count less and less (Cauchy weights).
    focal_px, focal_spread: what is known of the focal length and how well (of its logarithm).
    straight: keep the principal point and the distortion as they are.
    """
    known = focal_px or camera.focal_px
    centre = (np.array(camera.size) - 1) / 2
    middle = np.concatenate([[known], centre, np.zeros(5)])
    deviation = prior_deviation(known, camera.size, focal_spread)
    free = FREE_STRAIGHT if straight else PARAMETERS
    vector = camera.vector.copy()
    for _ in range(REWEIGHTINGS):
        away = reprojection_errors(PhotoCamera(vector, camera.size), points, pixels) / (CAUCHY * noise_px)
        weight = 1.0 / (np.sqrt(1.0 + away**2) * noise_px)
        vector[:free] = _fit(vector, free, points, pixels, weight, middle, deviation)
    return PhotoCamera(vector, camera.size)


def prior_deviation(focal_px: float, size: tuple[int, int], focal_spread: float = FOCAL_SPREAD) -> Floats:
    """Return prior standard deviations (8,) of focal length, principal point and distortion."""
    centre = np.full(2, CENTRE_SPREAD * np.hypot(*size))
    return np.concatenate([[focal_px * focal_spread], centre, DISTORTION_SPREAD])


def _fit(
    start: Floats, free: int, points: Floats, pixels: Floats, weight: Floats, middle: Floats, deviation: Floats
) -> Floats:
    """Fit the first `free` parameters by weighted least squares.

    The lens is held near what lenses are.
    """
    priors = np.eye(PARAMETERS)[6:, :free] / deviation[:, None]

    def full(vector: Floats) -> Floats:
        return np.concatenate([vector, start[free:]])

    def residuals(vector: Floats) -> Floats:
        seen, _ = project_with_jacobian(full(vector), points)
        return np.concatenate([((seen - pixels) * weight[:, None]).ravel(), (full(vector)[6:] - middle) / deviation])

    def jacobian(vector: Floats) -> Floats:
        _, slopes = project_with_jacobian(full(vector), points)
        return np.concatenate([(slopes * weight[:, None, None]).reshape(-1, PARAMETERS)[:, :free], priors])

    from scipy.optimize import least_squares  # a third of the time that this package takes to start

    found: Floats = least_squares(residuals, start[:free], jac=jacobian, x_scale="jac", method="lm").x
    return found
