"""A camera whose hand turns while the rows of a picture are read one after the other: rolling shutter.

The lens stays where it is: over the twentieth of a second of a readout a hand's tremor turns a camera much more than it
carries it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from oracles.simulation.camera import Camera
from restore.scan import Floats

ROUNDS = 6  # of finding the row that a point falls on: each gains as many digits as the turn is small


@dataclass(frozen=True, eq=False)
class RollingCamera(Camera):
    """A camera that turns from the first row to the last.

    turn_deg  (3,) rotation vector about the camera's axes, right, down and forward, from the first row to the last;
              `axes` are those of the middle row.
    """

    turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @classmethod
    def of(cls, camera: Camera, turn_deg: tuple[float, float, float]) -> RollingCamera:
        """A camera that turns while it is read."""
        return cls(**{field.name: getattr(camera, field.name) for field in fields(Camera)}, turn_deg=turn_deg)

    def project(self, points: Floats) -> Floats:
        """(…, 2) pixels at which points (…, 3) mm are seen: each in the row that is read when it falls on it."""
        flat = np.asarray(points, float).reshape(-1, 3)
        pixels = Camera.project(self, flat)
        for _ in range(ROUNDS):
            turned = self.position + self._turns(pixels[:, 1]).inv().apply(flat - self.position)
            pixels = Camera.project(self, turned)
        return np.asarray(pixels.reshape(*np.shape(points)[:-1], 2))

    def directions(self, top: int, bottom: int) -> NDArray[np.float32]:
        """(bottom − top, width, 3) lines of sight of the rows from `top` to before `bottom`, in the scanner's frame."""
        still = Camera.directions(self, top, bottom).astype(float)
        turns = self._turns(np.arange(top, bottom, dtype=float)).as_matrix()
        return np.asarray(np.einsum("rij,rcj->rci", turns, still), np.float32)

    def through(self, pixels: Floats) -> Floats:
        """(n, 3) lines of sight of pixels (n, 2), in the scanner's frame."""
        return np.asarray(self._turns(np.asarray(pixels, float)[:, 1]).apply(Camera.through(self, pixels)))

    def _turns(self, rows: Floats) -> Rotation:
        """The rotations of the scanner's frame that turn the camera from its middle row to rows (n,)."""
        share = (rows - (self.size[1] - 1) / 2) / self.size[1]
        return Rotation.from_rotvec(share[:, None] * (np.radians(self.turn_deg) @ self.axes))
