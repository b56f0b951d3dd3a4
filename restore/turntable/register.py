"""Registers a turntable's view from the known axis, by its surface and its print."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from restore.numerics.srgb import CONTRAST_PX, DARKEST, NOISE_BLUR_PX
from restore.runtime.native import load_open3d
from restore.scan import Floats, RangeScan

MAX_PAIR_DISTANCES = (4.0, 1.7, 1.0)  # samples between corresponding points; the first allows for an inexact axis
NORMAL_RADIUS, NORMAL_NEIGHBOURS = 6.0, 40  # samples round a point from which its normal is estimated
MAX_SOURCE_POINTS = 18_000  # samples of the view; more do not lower the error, which is that of the fixed grid
GEOMETRIC_WEIGHT = 0.9  # weight of the surface against the print: the surface alone lets a flat page slide
MAX_ITERATIONS = 30
CONVERGED = 1e-7


def register(view: RangeScan, reference: RangeScan, initial: Floats, spacing: float) -> Floats:
    """Return the motion (4, 4) of a view's points onto the reference.

    With colour in both, iterative closest points with colour (Park, Zhou, Koltun, "Colored Point Cloud Registration
    Revisited", ICCV 2017), where the colour is the print's contrast without shading; else by point-to-plane distances.
    Views without corresponding points keep the initial motion.
    initial: (4, 4), the motion by the turntable's angle, accurate to a few samples.
    spacing: mm between samples.
    """
    o3d = load_open3d()
    registration = o3d.pipelines.registration
    target = _cloud(reference)
    target.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(NORMAL_RADIUS * spacing, NORMAL_NEIGHBOURS))
    source = _cloud(view, max_points=MAX_SOURCE_POINTS)
    criteria = registration.ICPConvergenceCriteria(CONVERGED, CONVERGED, MAX_ITERATIONS)
    coloured = target.has_colors() and source.has_colors()
    motion = initial
    for max_distance in (max_distance * spacing for max_distance in MAX_PAIR_DISTANCES):
        try:
            if coloured:
                estimation = registration.TransformationEstimationForColoredICP(lambda_geometric=GEOMETRIC_WEIGHT)
                result = registration.registration_colored_icp(
                    source, target, max_distance, motion, estimation, criteria
                )
            else:
                estimation = registration.TransformationEstimationPointToPlane(registration.TukeyLoss(max_distance))
                result = registration.registration_icp(source, target, max_distance, motion, estimation, criteria)
        except RuntimeError:  # corresponding points are missing
            return initial
        motion = np.asarray(result.transformation)
    return motion


def _cloud(scan: RangeScan, max_points: int | None = None) -> Any:
    """The measured samples as open3d's point cloud, thinned evenly to `max_points`."""
    o3d, measured = load_open3d(), scan.measured
    stride = 1 if max_points is None else max(1, int(measured.sum()) // max_points)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(scan.points[measured][::stride]))
    if scan.texture is not None:
        grey = _print_contrast(scan)[measured][::stride]
        cloud.colors = o3d.utility.Vector3dVector(np.repeat(grey[:, None], 3, axis=1))
    return cloud


def _print_contrast(scan: RangeScan) -> Floats:
    """Return the local contrast of the print at each sample, 0 to 1.

    Returns (rows, cols), ½ without contrast.
    """
    assert scan.texture is not None
    codes = np.log(cv2.cvtColor(scan.texture, cv2.COLOR_RGB2GRAY).astype(np.float32) + DARKEST)
    contrast = cv2.GaussianBlur(codes, (0, 0), NOISE_BLUR_PX) - cv2.GaussianBlur(codes, (0, 0), CONTRAST_PX)
    positions = np.nan_to_num(scan.texture_xy, nan=-1.0).astype(np.float32)
    at_samples = cv2.remap(contrast, positions, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(np.clip(0.5 + at_samples, 0.0, 1.0), np.float64)
