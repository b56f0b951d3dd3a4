"""The camera that took a photograph: its pose, and its lens with Brown's distortion.

Camera coordinates are x right, y down and z forward; pixels (x right, y down), the centre of the upper left one (0, 0).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from restore.camera.brown import differentiate, imaged, seen_at, tangents_of
from restore.scan import Floats

PARAMETERS = 14
"""rotation vector 3, translation 3, focal length, principal point 2, k1, k2, p1, p2, k3"""


@dataclass(frozen=True, eq=False)
class PhotoCamera:
    """Pinhole camera with distortion, as OpenCV's `projectPoints` has it.

    Source: Brown, "Close-range camera calibration", 1971.
    vector: (14,) float64, PARAMETERS. Rotation and translation (mm) take the scanner's frame to the camera's.
    size: width and height of the photograph in pixels.
    """

    vector: Floats
    size: tuple[int, int]

    @cached_property
    def rotation(self) -> Floats:
        """Return the camera's axes in the scanner's frame, (3, 3), rows right, down and forward."""
        matrix: Floats = cv2.Rodrigues(self.vector[:3])[0]
        return matrix

    @property
    def position(self) -> Floats:
        """Return the camera's position (3,) mm in the scanner's frame."""
        return np.asarray(-self.rotation.T @ self.vector[3:6])

    @property
    def focal_px(self) -> float:
        """Focal length in pixels."""
        return float(self.vector[6])

    def project(self, points: Floats) -> Floats:
        """Project points (n, 3) mm to pixels (n, 2).

        Returns NaN for those that the lens cannot see.
        """
        return _project(np.ascontiguousarray(points, np.float64), self.rotation, self.vector, self.reach)

    def inverse_depth(self, points: Floats) -> Floats:
        """Return the inverse depth (n,) 1/mm of points along the camera's axis.

        It is not positive behind the camera.
        """
        return np.asarray(1.0 / (points @ self.rotation[2] + self.vector[5]))

    @cached_property
    def reach(self) -> float:
        """Squared tangent of the angle to the axis up to which the distortion is one to one."""
        k1, k2, k3 = self.vector[[9, 10, 13]]
        # d/dr of r·(1 + k1 r² + k2 r⁴ + k3 r⁶), in r²
        roots = np.roots([7 * k3, 5 * k2, 3 * k1, 1.0])
        turning = roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)].real
        return float(turning.min()) if len(turning) else np.inf

    def scaled(self, size: tuple[int, int]) -> PhotoCamera:
        """The camera of the same photograph at another size."""
        ratio = size[0] / self.size[0]
        vector = self.vector.copy()
        vector[6] *= ratio
        vector[7:9] = (vector[7:9] + 0.5) * ratio - 0.5
        return PhotoCamera(vector, size)

    def described(self) -> dict[str, Any]:
        """The camera in plain values, for the report."""
        k1, k2, p1, p2, k3 = (float(value) for value in self.vector[9:])
        return {
            "focal_px": self.focal_px,
            "principal_point_px": self.vector[7:9].tolist(),
            "radial": [k1, k2, k3],
            "tangential": [p1, p2],
            "position_mm": self.position.tolist(),
            "axes": self.rotation.tolist(),
        }


def project_with_jacobian(vector: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Project points and differentiate by the camera's parameters.

    points: (n, 3) mm. Returns pixels (n, 2) and derivatives (n, 2, 14).
    """
    turn, by_vector = cv2.Rodrigues(vector[:3])
    pixels, jacobian = _differentiated(np.ascontiguousarray(points, np.float64), turn, vector)
    # What the vector changes turns the camera about its axes: dR Rᵀ is the cross product with that turn.
    spins = by_vector.reshape(3, 3, 3) @ turn.T
    jacobian[..., :3] = jacobian[..., :3] @ spins[:, [2, 0, 1], [1, 2, 0]].T
    return pixels, jacobian


def project_map(camera: PhotoCamera, points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Project a map of surface points (h, w, 3) mm to pixels.

    Returns (h, w, 2) float32, NaN where points are missing or the lens cannot see them.
    """
    flat = _project(points.reshape(-1, 3), camera.rotation, camera.vector, camera.reach)
    return flat.reshape(*points.shape[:2], 2).astype(np.float32)


@numba.njit(cache=True, nogil=True)
def _project(points: Floats, turn: Floats, camera: Floats, reach: float) -> Floats:
    pixels = np.full((len(points), 2), np.nan)
    for n in range(len(points)):
        x, y, depth = tangents_of(turn, camera, points[n, 0], points[n, 1], points[n, 2])
        if depth > 0.0 and x * x + y * y <= reach:
            pixels[n] = imaged(camera, x, y)
    return pixels


@numba.njit(cache=True, nogil=True)
def _differentiated(points: Floats, turn: Floats, camera: Floats) -> tuple[Floats, Floats]:
    """Pixels (n, 2) of points (n, 3), and derivatives (n, 2, 14) as `differentiate` has them."""
    pixels, by_camera, by_point = np.empty((len(points), 2)), np.empty((len(points), 2, PARAMETERS)), np.empty((2, 3))
    for n in range(len(points)):
        pixels[n] = seen_at(turn, camera, points[n, 0], points[n, 1], points[n, 2])
        differentiate(turn, camera, points[n], by_camera[n], by_point)
    return pixels, by_camera
