"""Register a view of a turntable: from the known axis first, then by its surface and its print."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from restore.native import load_open3d
from restore.scan import Floats, RangeScan

REACHES = (4.0, 1.7, 1.0)  # samples: how far apart partners may be, at first for an axis that is a little off
NORMAL_REACH, NORMAL_POINTS = 6.0, 40  # samples round a point that give it its normal
MOST_MOVED = 18_000  # samples of the view; more do not lower the error, which is that of the fixed grid
BY_SURFACE = 0.9  # weight of the surface against the print: the surface alone lets a flat page slide
INK_PX, LIGHT_PX = 1.0, 8.0  # print is finer than light and shadow, and coarser than the sensor's noise
BLACK = 8.0  # codes: below, the logarithm would be all noise
ROUNDS = 30
SETTLED = 1e-7


def register(view: RangeScan, reference: RangeScan, start: Floats, spacing: float) -> Floats:
    """(4, 4) motion that takes a view's points onto those of the reference.

    start    the motion that the turntable tells, right to a few samples.
    spacing  mm between samples.
    With colour in both, iterative closest points with colour (Park, Zhou, Koltun, "Colored Point Cloud Registration
    Revisited", ICCV 2017), where the colour is what is printed, freed of light and shadow; else by planes.
    Views that have nothing near each other stay where the turntable puts them.
    """
    o3d = load_open3d()
    registration = o3d.pipelines.registration
    still = _cloud(reference)
    still.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(NORMAL_REACH * spacing, NORMAL_POINTS))
    moved = _cloud(view, most=MOST_MOVED)
    criteria = registration.ICPConvergenceCriteria(SETTLED, SETTLED, ROUNDS)
    coloured = still.has_colors() and moved.has_colors()
    motion = start
    for reach in (reach * spacing for reach in REACHES):
        try:
            if coloured:
                how = registration.TransformationEstimationForColoredICP(lambda_geometric=BY_SURFACE)
                found = registration.registration_colored_icp(moved, still, reach, motion, how, criteria)
            else:
                how = registration.TransformationEstimationPointToPlane(registration.TukeyLoss(reach))
                found = registration.registration_icp(moved, still, reach, motion, how, criteria)
        except RuntimeError:  # no point has a partner
            return start
        motion = np.asarray(found.transformation)
    return motion


def _cloud(scan: RangeScan, most: int | None = None) -> Any:
    """The measured samples as open3d's point cloud, thinned evenly to `most`."""
    o3d, measured = load_open3d(), scan.measured
    every = 1 if most is None else max(1, int(measured.sum()) // most)
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(scan.points[measured][::every]))
    if scan.texture is not None:
        grey = _print_of(scan)[measured][::every]
        cloud.colors = o3d.utility.Vector3dVector(np.repeat(grey[:, None], 3, axis=1))
    return cloud


def _print_of(scan: RangeScan) -> Floats:
    """(rows, cols) 0 to 1: how dark each sample is against what lies round it."""
    assert scan.texture is not None
    codes = np.log(cv2.cvtColor(scan.texture, cv2.COLOR_RGB2GRAY).astype(np.float32) + BLACK)
    contrast = cv2.GaussianBlur(codes, (0, 0), INK_PX) - cv2.GaussianBlur(codes, (0, 0), LIGHT_PX)
    where = np.nan_to_num(scan.texture_xy, nan=-1.0).astype(np.float32)
    at_samples = cv2.remap(contrast, where, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(np.clip(0.5 + at_samples, 0.0, 1.0), np.float64)
