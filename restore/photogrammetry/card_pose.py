"""Pose of the scale card in a model of photographs, from all markers in all views."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np

from restore.camera.photo_camera import PhotoCamera, project_with_jacobian
from restore.numerics.robust import CAUCHY, NEARLY_ALL, robust_sigma
from restore.photogrammetry.cameras.align import (
    MIN_MARKERS,
    Similarity,
    agreeing_markers,
    fit_similarity,
    triangulate_markers,
)
from restore.photogrammetry.cameras.card import ScaleCard
from restore.photogrammetry.track import MIN_SIGMA_PX
from restore.scan import Floats

STEPS = 10


def find_card(
    cameras: Mapping[int, PhotoCamera], markers: Mapping[int, Mapping[int, Floats]], card: ScaleCard
) -> tuple[Similarity, float, int] | None:
    """Find the similarity from the card's frame to that of the cameras.

    The reprojection errors of all are least, with the weights that Cauchy's distribution gives them.
    markers: photograph → marker → pixel (2,).
    Returns also its rms error in mm on the card without the worst tenth, and the number of markers. None when too few
    of them are seen in three views.
    """
    agreeing = agreeing_markers(cameras, markers)
    found = triangulate_markers(cameras, agreeing)
    if len(found) < MIN_MARKERS:
        return None
    centres = np.column_stack([card.centres, np.zeros(len(card.centres))])
    pose = fit_similarity(centres[list(found)], np.array(list(found.values())))
    seen = [(view, marker) for view, shown in agreeing.items() for marker in shown]
    for _ in range(STEPS):
        pixels, rows = _equations(pose, centres, cameras, seen)
        errors = np.array([markers[view][marker] for view, marker in seen]) - pixels
        length = np.linalg.norm(errors, axis=1)
        sigma = max(robust_sigma(errors.ravel()), MIN_SIGMA_PX)
        weights = 1.0 / (1.0 + (length / (CAUCHY * sigma)) ** 2)
        root = np.sqrt(weights)[:, None]
        step = np.linalg.lstsq((rows * root[..., None]).reshape(-1, 7), (errors * root).ravel(), rcond=None)[0]
        pose = Similarity(
            pose.scale * float(np.exp(step[0])), cv2.Rodrigues(step[1:4])[0] @ pose.rotation, pose.shift + step[4:]
        )
    per_mm = np.linalg.norm(rows[:, :, 4:], axis=(1, 2)) / np.sqrt(2.0) * pose.scale
    # The page may hide a part of a marker.
    off = np.sort(length / per_mm)[: max(int(len(length) * NEARLY_ALL), 1)]
    error = float(np.sqrt((off**2).mean()))  # without weights: a card that is not flat must show
    return pose, error, len({marker for _, marker in seen})


def _equations(
    pose: Similarity, centres: Floats, cameras: Mapping[int, PhotoCamera], seen: list[tuple[int, int]]
) -> tuple[Floats, Floats]:
    """Return pixels of markers and their derivatives.

    Pixels (m, 2); derivatives (m, 2, 7) by log scale, rotation and shift.
    """
    pixels, rows = np.empty((len(seen), 2)), np.empty((len(seen), 2, 7))
    for number, (view, marker) in enumerate(seen):
        arm = pose.scale * pose.rotation @ centres[marker]
        pixel, jacobian = project_with_jacobian(cameras[view].vector, (arm + pose.shift)[None])
        by_point = jacobian[0, :, 3:6] @ cameras[view].rotation
        pixels[number] = pixel[0]
        rows[number] = np.column_stack([by_point @ arm, np.cross(arm, by_point), by_point])
    return pixels, rows
