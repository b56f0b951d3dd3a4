"""The corners of a flat board's markers, in space."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np

from restore.camera.rays import Rays, find_rays
from restore.errors import BadInput
from restore.numerics.robust import SIGNIFICANT, robust_sigma
from restore.scan import Bytes, Floats, RangeScan

ITERATIONS = 5  # of a fit to the samples that are significantly near to it
NO_BOARD = "put a flat board with ArUco markers (DICT_4X4) on the stage, in the depth window and evenly lit"


def board_corners(scan: RangeScan) -> Mapping[int, Floats]:
    """Return the corners (4, 3) mm of detected DICT_4X4 markers, in the scanner's frame.

    A corner is the intersection of its line of sight, known to a tenth of a pixel from the colour image, with the plane
    of the board, fitted to all samples between the markers. Raises BadInput when the scan shows no such board, or is
    not one capture of a scanner.
    """
    rays = find_rays(scan)
    if rays is None or scan.texture is None:
        raise BadInput("the board must be scanned in one capture, with colour", "use a scan of the scanner's own")
    detected = _detect_markers(scan.texture)
    if not detected:
        raise BadInput("the scan shows no markers", NO_BOARD)
    by_marker = {marker: _grid_positions(scan, corners) for marker, corners in detected.items()}
    plane = _fit_plane(scan, np.concatenate(list(by_marker.values())))
    return {marker: _intersect(rays, plane, positions) for marker, positions in by_marker.items()}


def _detect_markers(texture: Bytes) -> Mapping[int, Floats]:
    """Marker → its corners (4, 2) in texture pixels."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
    grey = cv2.cvtColor(texture, cv2.COLOR_RGB2GRAY)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(grey)
    if ids is None:
        return {}
    return {int(i): c.reshape(4, 2).astype(float) for i, c in zip(ids.ravel(), corners, strict=True)}


def _grid_positions(scan: RangeScan, pixels: Floats) -> Floats:
    """Return row and column (n, 2) of the samples at texture pixels, fractions included.

    pixels: (n, 2).
    """
    rows, cols = np.nonzero(np.isfinite(scan.texture_xy).all(axis=2))
    design = np.column_stack([scan.texture_xy[rows, cols], np.ones(len(rows))])
    fit, *_ = np.linalg.lstsq(design, np.column_stack([rows, cols]), rcond=None)
    return np.asarray(np.column_stack([pixels, np.ones(len(pixels))]) @ fit)


def _fit_plane(scan: RangeScan, positions: Floats) -> Floats:
    """Return the board's inverse depth as an affine function (3,) of row and column."""
    hull = cv2.convexHull(positions[:, ::-1].astype(np.float32)).astype(np.int32)
    inside = cv2.fillConvexPoly(np.zeros(scan.measured.shape, np.uint8), hull, 1).astype(bool)
    rows, cols = np.nonzero(inside & scan.measured)
    if len(rows) < 3:
        raise BadInput("the board's surface was not measured", NO_BOARD)
    design = np.column_stack([np.ones(len(rows)), rows, cols])
    values = -1.0 / scan.points[rows, cols, 2]
    inliers = np.ones(len(rows), bool)
    for _ in range(ITERATIONS):
        plane, *_ = np.linalg.lstsq(design[inliers], values[inliers], rcond=None)
        residual = np.abs(design @ plane - values)
        inliers = residual <= SIGNIFICANT * robust_sigma(residual)
    return np.asarray(plane)


def _intersect(rays: Rays, plane: Floats, positions: Floats) -> Floats:
    return rays.points(positions[:, 0], positions[:, 1], plane[0] + positions @ plane[1:])
