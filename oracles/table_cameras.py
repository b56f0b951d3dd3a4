"""Cameras over a table and pictures of planes through them: exact views for the tests of photogrammetry."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from restore.camera.photo_camera import PhotoCamera

SIZE = (480, 360)
FOCAL_PX = 420.0
LENS = (0.05, -0.08, 4e-4, -3e-4, 0.03)  # k1, k2, p1, p2, k3
PLACES_MM = (
    (10.0, -20.0, 300.0),
    (150.0, 30.0, 270.0),
    (-140.0, 60.0, 280.0),
    (20.0, 160.0, 260.0),
    (30.0, -150.0, 270.0),
)


def camera_at(place, target=(0.0, 0.0, 0.0), *, focal=FOCAL_PX, lens=LENS, roll=0.1) -> PhotoCamera:
    """A camera at a place (3,) mm that looks at a target, z up."""
    forward = np.asarray(target) - np.asarray(place)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [np.sin(roll), np.cos(roll), 0.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    turn = cv2.Rodrigues(rotation)[0].ravel()
    centre = (SIZE[0] - 1) / 2 + 1.5, (SIZE[1] - 1) / 2 - 2.0
    return PhotoCamera(np.array([*turn, *(-rotation @ np.asarray(place)), focal, *centre, *lens]), SIZE)


def cameras(count: int = 5) -> list[PhotoCamera]:
    """Cameras from above and from all sides."""
    return [camera_at(place, roll=0.1 * k) for k, place in enumerate(PLACES_MM[:count])]


def picture(camera: PhotoCamera, light: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
    """(h, w) float32: light(origins, ways) along the line of sight (n, 3) of every pixel."""
    width, height = camera.size
    cols, rows = np.meshgrid(np.arange(width), np.arange(height))
    pixels = np.stack([cols.ravel(), rows.ravel()], axis=1).astype(float)
    focal, cx, cy = camera.vector[6:9]
    matrix = np.array([[focal, 0, cx], [0, focal, cy], [0, 0, 1.0]])
    criteria = (cv2.TERM_CRITERIA_COUNT, 20, 0.0)
    tangents = cv2.undistortPoints(pixels[:, None], matrix, camera.vector[9:], None, None, None, criteria)[:, 0]
    ways = np.column_stack([tangents, np.ones(len(tangents))]) @ camera.rotation
    origins = np.broadcast_to(camera.position, ways.shape)
    return light(origins, ways).reshape(height, width).astype(np.float32)


def on_plane(origins, ways, height: float) -> np.ndarray:
    """(n, 2) where lines of sight meet the plane z = height."""
    return (origins + ways * ((height - origins[:, 2]) / ways[:, 2])[:, None])[:, :2]


def mottled(places: np.ndarray) -> np.ndarray:
    """(n,) a smooth pattern without period over places (n, 2) mm, 60 to 190."""
    x, y = places.T
    waves = ((0.9, 0.3, 0.0), (-0.4, 0.8, 1.0), (0.5, -0.7, 2.0), (1.1, 0.9, 3.0), (0.2, 1.2, 4.0))
    return 125.0 + 13.0 * sum(np.sin(0.9 * (a * x + b * y) + c + 0.02 * x * b) for a, b, c in waves)
