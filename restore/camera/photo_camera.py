"""The camera that took a photograph: its pose, and its lens with Brown's distortion.

Camera coordinates are x right, y down and z forward; pixels (x right, y down), the centre of the upper left one (0, 0).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

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

    @property
    def rotation(self) -> Floats:
        """Return the camera's axes in the scanner's frame.

        Returns (3, 3), rows right, down and forward.
        """
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

    @property
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
    matrix = np.array([[vector[6], 0, vector[7]], [0, vector[6], vector[8]], [0, 0, 1.0]])
    pixels, jacobian = cv2.projectPoints(points, vector[:3], vector[3:6], matrix, vector[9:])
    # columns: rotation 3, translation 3, focal lengths 2, principal point 2, distortion 5
    joined = np.column_stack([jacobian[:, :6], jacobian[:, 6] + jacobian[:, 7], jacobian[:, 8:15]])
    return pixels.reshape(-1, 2), joined.reshape(-1, 2, PARAMETERS)


def project_map(camera: PhotoCamera, points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Project a map of surface points (h, w, 3) mm to pixels.

    Returns (h, w, 2) float32, NaN where points are missing or the lens cannot see them.
    """
    flat = _project(points.reshape(-1, 3), camera.rotation, camera.vector, camera.reach)
    return flat.reshape(*points.shape[:2], 2).astype(np.float32)


@numba.njit(cache=True, nogil=True)
def _project(points: Floats, axes: Floats, lens: Floats, reach: float) -> Floats:
    tx, ty, tz, focal, cx, cy, k1, k2, p1, p2, k3 = lens[3:14]
    pixels = np.empty((len(points), 2))
    for n in range(len(points)):
        px, py, pz = points[n, 0], points[n, 1], points[n, 2]
        z = axes[2, 0] * px + axes[2, 1] * py + axes[2, 2] * pz + tz
        pixels[n] = np.nan
        if not z > 0.0:
            continue
        x = (axes[0, 0] * px + axes[0, 1] * py + axes[0, 2] * pz + tx) / z
        y = (axes[1, 0] * px + axes[1, 1] * py + axes[1, 2] * pz + ty) / z
        r2 = x * x + y * y
        if r2 > reach:
            continue
        stretch = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        pixels[n, 0] = focal * (x * stretch + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)) + cx
        pixels[n, 1] = focal * (y * stretch + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y) + cy
    return pixels
