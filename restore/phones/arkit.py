"""Cameras as Apple's ARKit gives them, in this library's convention.

ARKit's world is right-handed, y up, in metres; a camera looks along its −z, x right and y up, and its pose takes the
camera's coordinates to the world's (`ARCamera.transform`). Here z is up, in millimetres, and a camera looks along +z,
x right and y down.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from restore.camera.photo_camera import PARAMETERS, PhotoCamera
from restore.errors import BadInput
from restore.formats.calibration import ORTHONORMAL
from restore.formats.parsing.source import DAMAGED
from restore.scan import Floats

MM_PER_METRE = 1000.0
UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])  # y up to z up
LENS = np.diag([1.0, -1.0, -1.0])  # y up and z back to y down and z forward
SQUARE = 0.01  # of the focal length: pixels of phones are square


@dataclass(frozen=True, eq=False)
class Frame:
    """Photograph of a capture.

    picture: its file.
    camera: that took it.
    sharpness: as the program rates it, more is sharper.
    """

    picture: Path
    camera: PhotoCamera
    sharpness: float = 0.0


def world_to_mm(points: Floats) -> Floats:
    """Convert points (n, 3) of ARKit's world to mm, z up."""
    return np.asarray(points @ UPRIGHT.T * MM_PER_METRE)


def camera_of(
    path: Path, pose: Floats, intrinsics: tuple[float, float, float, float], size: tuple[int, int]
) -> PhotoCamera:
    """Return the camera of a pose (4, 4) and of intrinsics.

    path: the file that they are in.
    intrinsics: focal lengths fx, fy and principal point cx, cy in pixels.
    Raises BadInput for numbers that do not describe a camera.
    """
    fx, fy, cx, cy = intrinsics
    rotation = pose[:3, :3]
    if not np.isfinite(pose).all() or np.abs(rotation @ rotation.T - np.eye(3)).max() > ORTHONORMAL:
        raise BadInput(f"{path}: its pose is not a rotation and translation", DAMAGED)
    if not (fx > 0 and abs(fx - fy) < SQUARE * fx and 0 < cx < size[0] and 0 < cy < size[1]):
        numbers = f"fx {fx:g}, fy {fy:g}, cx {cx:g}, cy {cy:g}"
        raise BadInput(f"{path}: {numbers} are not the camera of images of {size[0]} × {size[1]}", DAMAGED)
    turned = LENS @ rotation.T @ UPRIGHT.T
    vector = np.zeros(PARAMETERS)
    vector[:3] = cv2.Rodrigues(turned)[0].ravel()
    vector[3:6] = -turned @ world_to_mm(pose[None, :3, 3])[0]
    vector[6:9] = (fx + fy) / 2, cx, cy
    return PhotoCamera(vector, size)
