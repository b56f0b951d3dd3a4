"""The corners of a flat board's markers, in space."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np

from restore.errors import BadInput
from restore.range_image.camera import Rays, find_rays
from restore.robust import robust_sigma
from restore.scan import Bytes, Floats, RangeScan

TRIMMED_SIGMAS, ROUNDS = 3.0, 5  # samples this far off the board's plane do not belong to it
NO_BOARD = "put a flat board with ArUco markers (DICT_4X4) on the stage, in the depth window and evenly lit"


def board_corners(scan: RangeScan) -> Mapping[int, Floats]:
    """Marker → its corners (4, 3) mm in the scanner's frame, of the markers of the dictionary 4×4 that are seen.

    A corner is where its line of sight meets the plane of the board: the colour image tells the first to a tenth of a
    pixel, and all samples between the markers the second.
    Raises BadInput when there is no such board, or the scan is not one shot of a scanner.
    """
    rays = find_rays(scan)
    if rays is None or scan.texture is None:
        raise BadInput("the board must be scanned in one shot, with colour", "use a scan of the scanner's own")
    seen = _detect(scan.texture)
    if not seen:
        raise BadInput("there is no marker in the scan", NO_BOARD)
    places = {marker: _grid_position(scan, corners) for marker, corners in seen.items()}
    plane = _plane(scan, np.concatenate(list(places.values())))
    return {marker: _meet(rays, plane, at) for marker, at in places.items()}


def _detect(texture: Bytes) -> Mapping[int, Floats]:
    """Marker → its corners (4, 2) in texture pixels."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
    grey = cv2.cvtColor(texture, cv2.COLOR_RGB2GRAY)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(grey)
    if ids is None:
        return {}
    return {int(i): c.reshape(4, 2).astype(float) for i, c in zip(ids.ravel(), corners, strict=True)}


def _grid_position(scan: RangeScan, pixels: Floats) -> Floats:
    """(n, 2) row and column, fractions allowed, of the samples at texture pixels (n, 2)."""
    rows, cols = np.nonzero(np.isfinite(scan.texture_xy).all(axis=2))
    terms = np.column_stack([scan.texture_xy[rows, cols], np.ones(len(rows))])
    fit, *_ = np.linalg.lstsq(terms, np.column_stack([rows, cols]), rcond=None)
    return np.asarray(np.column_stack([pixels, np.ones(len(pixels))]) @ fit)


def _plane(scan: RangeScan, places: Floats) -> Floats:
    """(3,) inverse depth of the plane of the board as an affine function of row and column."""
    hull = cv2.convexHull(places[:, ::-1].astype(np.float32)).astype(np.int32)
    inside = cv2.fillConvexPoly(np.zeros(scan.measured.shape, np.uint8), hull, 1).astype(bool)
    rows, cols = np.nonzero(inside & scan.measured)
    if len(rows) < 3:
        raise BadInput("the board's surface was not measured", NO_BOARD)
    terms = np.column_stack([np.ones(len(rows)), rows, cols])
    values = -1.0 / scan.points[rows, cols, 2]
    kept = np.ones(len(rows), bool)
    for _ in range(ROUNDS):
        plane, *_ = np.linalg.lstsq(terms[kept], values[kept], rcond=None)
        off = np.abs(terms @ plane - values)
        kept = off <= TRIMMED_SIGMAS * robust_sigma(off)
    return np.asarray(plane)


def _meet(rays: Rays, plane: Floats, at: Floats) -> Floats:
    return rays.points(at[:, 0], at[:, 1], plane[0] + at @ plane[1:])
