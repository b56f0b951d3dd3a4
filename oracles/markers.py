"""How true a restored marker page is: corners found in the picture against corners on the flat page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np

from restore.scan import Bytes, Floats

MM_PER_INCH = 25.4
THRESHOLD_WINDOW = 53  # pixels: wide enough for markers of a page painted at 150 dpi


@dataclass(frozen=True)
class MarkerError:
    """rms_mm after a rigid fit without scaling; found of all markers; scale that would have fitted best."""

    rms_mm: float
    found: int
    of: int
    scale: float
    mirrored: bool


def marker_error(image: Bytes, dpi: float, truth: Mapping[int, Floats]) -> MarkerError:
    """Compare the markers of a page (h, w, 3) with their true corners, id → (4, 2) mm with y up."""
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    found, mirrored = _find(grey, truth), _find(np.ascontiguousarray(grey[:, ::-1]), truth)
    if len(found) < 2:
        return MarkerError(np.inf, len(found), len(truth), np.nan, len(mirrored) > len(found))
    seen = np.concatenate(list(found.values())) * [MM_PER_INCH / dpi, -MM_PER_INCH / dpi]
    true = np.concatenate([truth[marker] for marker in found])
    rest, scale = rigid_residual(seen, true)
    rms = float(np.sqrt((rest**2).sum(axis=1).mean()))
    return MarkerError(rms, len(found), len(truth), scale, len(mirrored) > len(found))


def rigid_residual(points: Floats, truth: Floats) -> tuple[Floats, float]:
    """What is left of points − truth (n, 2) after the best rigid motion, and the best scale (Umeyama 1991)."""
    a, b = points - points.mean(axis=0), truth - truth.mean(axis=0)
    u, stretch, vt = np.linalg.svd(a.T @ b)
    proper = np.diag([1.0, np.sign(np.linalg.det(u @ vt))])
    return a @ u @ proper @ vt - b, float((stretch * np.diag(proper)).sum() / (a**2).sum())


def _find(grey: np.ndarray, truth: Mapping[int, Floats]) -> dict[int, Floats]:
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    parameters.adaptiveThreshWinSizeMax = THRESHOLD_WINDOW
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(grey)
    if ids is None:
        return {}
    return {int(i): c.reshape(4, 2) for i, c in zip(ids.ravel(), corners, strict=True) if int(i) in truth}
