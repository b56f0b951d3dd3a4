"""A camera and a projector whose lenses and positions are known."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from restore.scan import Floats
from restore.structured_light.patterns import Projector

CORRECTIONS = 20  # of `undistortPoints`, whose five steps leave a tenth of a pixel at the corners of a phone's lens
EXACT_PX = 1e-6  # finer than any picture


@dataclass(frozen=True, eq=False)
class Lens:
    """A pinhole with distortion, of a camera or of a projector.

    matrix      (3, 3) pixels: focal lengths and principal point, the centre of the upper left pixel (0, 0).
    distortion  (k,) k1, k2, p1, p2, k3, … as OpenCV's `projectPoints` has them.
    """

    matrix: Floats
    distortion: Floats

    def tangents(self, pixels: Floats) -> Floats:
        """Return the tangents (n, 2) of the lines of sight of pixels (n, 2).

        x right and y down.
        """
        points = np.ascontiguousarray(pixels, np.float64).reshape(-1, 1, 2)
        tangents: Floats = cv2.undistortPoints(points, self.matrix, self.distortion).reshape(-1, 2)
        for _ in range(CORRECTIONS):
            off = points[:, 0] - self.pixels(tangents)
            if not (np.abs(off) > EXACT_PX).any():
                break
            tangents = tangents + off / self.matrix[[0, 1], [0, 1]]
        return tangents

    def pixels(self, tangents: Floats) -> Floats:
        """Return the pixels (n, 2) of lines of sight with tangents (n, 2)."""
        points = np.column_stack([tangents, np.ones(len(tangents))])
        return np.asarray(cv2.projectPoints(points, np.zeros(3), np.zeros(3), self.matrix, self.distortion)[0][:, 0])


@dataclass(frozen=True, eq=False)
class Rig:
    """A camera and a projector.

    rotation, shift  (3, 3) and (3,) mm: a point p in the camera's frame (x right, y down, z forward) lies at
                     rotation · p + shift in the projector's, as OpenCV's `stereoCalibrate` has them.
    size             width and height of the camera's picture, None where the calibration does not say.
    """

    camera: Lens
    lamp: Lens
    projector: Projector
    rotation: Floats
    shift: Floats
    size: tuple[int, int] | None = None
