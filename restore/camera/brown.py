"""Pinhole camera with Brown's distortion, compiled: a point's pixel and its derivatives.

A camera is the vector (14,) of `PhotoCamera` with its rotation matrix `turn` (3, 3). Source: Brown, "Close-range camera
calibration", 1971.
"""

from __future__ import annotations

import numba

from restore.scan import Floats


@numba.njit(cache=True, error_model="numpy")
def tangents_of(turn: Floats, camera: Floats, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return the tangents of a point (x, y, z) mm, and its depth, mm.

    They are those of its angles to the axis, right and down.
    turn, camera: (3, 3) and (14,).
    """
    depth = turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z + camera[5]
    right = turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z + camera[3]
    down = turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z + camera[4]
    return right / depth, down / depth, depth


@numba.njit(cache=True)
def imaged(camera: Floats, x: float, y: float) -> tuple[float, float]:
    """Return the pixel of tangents x and y in a camera (14,)."""
    r2 = x * x + y * y
    stretch = 1.0 + r2 * (camera[9] + r2 * (camera[10] + r2 * camera[13]))
    u = x * stretch + 2.0 * camera[11] * x * y + camera[12] * (r2 + 2.0 * x * x)
    v = y * stretch + camera[11] * (r2 + 2.0 * y * y) + 2.0 * camera[12] * x * y
    return camera[6] * u + camera[7], camera[6] * v + camera[8]


@numba.njit(cache=True)
def seen_at(turn: Floats, camera: Floats, x: float, y: float, z: float) -> tuple[float, float]:
    """Return the pixel of a point (x, y, z) mm.

    turn, camera: (3, 3) and (14,).
    """
    right, down, _ = tangents_of(turn, camera, x, y, z)
    return imaged(camera, right, down)


@numba.njit(cache=True)
def differentiate(turn: Floats, camera: Floats, point: Floats, by_camera: Floats, by_point: Floats) -> None:
    """Write the derivatives of a pixel by its camera and its point.

    by_camera: (2, 14), of the rotation by angles about the camera's axes: d(R p) = w × R p.
    by_point: (2, 3).
    """
    x, y, z = tangents_of(turn, camera, point[0], point[1], point[2])
    focal, k1, k2, p1, p2, k3 = camera[6], camera[9], camera[10], camera[11], camera[12], camera[13]
    r2 = x * x + y * y
    stretch = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    bend = k1 + r2 * (2 * k2 + 3 * r2 * k3)  # of the stretch by r²
    mixed = 2 * x * y * bend + 2 * p1 * x + 2 * p2 * y
    seen = imaged(camera, x, y)
    right, down, away = x * z - camera[3], y * z - camera[4], z - camera[5]  # the point turned, not shifted
    for row in range(2):
        along, a, b = x, stretch + 2 * x * x * bend + 2 * p1 * y + 6 * p2 * x, mixed
        if row == 1:
            along, a, b = y, mixed, stretch + 2 * y * y * bend + 6 * p1 * y + 2 * p2 * x
        # by the point in the camera's frame, where it is (x, y, 1) z
        cx, cy, cz = focal * a / z, focal * b / z, -focal * (a * x + b * y) / z
        by_camera[row, 0] = cz * down - cy * away
        by_camera[row, 1] = cx * away - cz * right
        by_camera[row, 2] = cy * right - cx * down
        by_camera[row, 3], by_camera[row, 4], by_camera[row, 5] = cx, cy, cz
        by_camera[row, 6] = (seen[row] - camera[7 + row]) / focal
        by_camera[row, 7], by_camera[row, 8] = 1.0 - row, 1.0 * row
        by_camera[row, 9], by_camera[row, 10] = focal * along * r2, focal * along * r2 * r2
        by_camera[row, 11] = focal * (2 * x * y if row == 0 else r2 + 2 * y * y)
        by_camera[row, 12] = focal * (r2 + 2 * x * x if row == 0 else 2 * x * y)
        by_camera[row, 13] = focal * along * r2 * r2 * r2
        for k in range(3):
            by_point[row, k] = cx * turn[0, k] + cy * turn[1, k] + cz * turn[2, k]
