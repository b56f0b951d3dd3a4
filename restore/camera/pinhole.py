"""A pinhole camera from points and their pixels, by direct linear transformation."""

from __future__ import annotations

import numpy as np

from restore.numerics.limits import TINY
from restore.scan import Floats

MAX_REPROJECTION_PX = 2.0  # rms, texture pixels: a picture of one pinhole camera has less, an atlas of patches more
MIN_POINTS = 12  # six points determine a pinhole camera; twice as many show whether the picture is one's
MIN_SINGULAR_VALUE = 1e-4  # of the largest: below, the points are coplanar and do not determine a camera
NEARLY_PARALLEL = 1e-9  # 1/mm: a camera a thousand kilometres away


def centre_of(camera: Floats) -> Floats:
    """Return the centre (3,) mm of a camera matrix (3, 4)."""
    *direction, weight = np.linalg.svd(camera)[2][3]  # the null vector, of weight 0 at infinity
    return np.asarray(direction) / np.copysign(max(abs(weight), NEARLY_PARALLEL), weight)


def projected(points: Floats, camera: Floats) -> Floats:
    """Project points (n, 3) mm by a camera matrix (3, 4) to pixels (n, 2)."""
    pixels = np.column_stack([points, np.ones(len(points))]) @ camera.T
    return np.asarray(pixels[:, :2] / pixels[:, 2:])


def pinhole_camera(points: Floats, pixels: Floats) -> Floats | None:
    """Fit the pinhole camera that images points at pixels.

    Direct linear transformation with normalised coordinates (Hartley & Zisserman, "Multiple View Geometry", 2nd ed.,
    alg. 7.1). It is not determined by coplanar points.
    points: (n, 3) mm.
    pixels: (n, 2).
    Returns (3, 4), or None without such a camera.
    """
    if len(points) < MIN_POINTS:
        return None
    world, to_world = _normalised(points)
    seen, to_seen = _normalised(pixels)
    homogeneous = np.column_stack([world, np.ones(len(world))])
    zeros = np.zeros_like(homogeneous)
    rows = np.concatenate(
        [
            np.column_stack([homogeneous, zeros, -seen[:, :1] * homogeneous]),
            np.column_stack([zeros, homogeneous, -seen[:, 1:] * homogeneous]),
        ]
    )
    values, vectors = np.linalg.eigh(rows.T @ rows)
    if values[1] < MIN_SINGULAR_VALUE**2 * values[-1]:
        return None
    camera = np.linalg.inv(to_seen) @ vectors[:, 0].reshape(3, 4) @ to_world
    error = projected(points, camera) - pixels
    return None if np.sqrt((error**2).sum(axis=1).mean()) > MAX_REPROJECTION_PX else camera


def _normalised(points: Floats) -> tuple[Floats, Floats]:
    """Centre points and scale them to unit mean square.

    points: (n, k). Returns them and the matrix (k + 1, k + 1) that does it.
    """
    centre = points.mean(axis=0)
    scale = 1 / max(float(np.sqrt(((points - centre) ** 2).sum(axis=1).mean())), TINY)
    size = points.shape[1]
    matrix = np.eye(size + 1)
    matrix[:size, :size] *= scale
    matrix[:size, size] = -scale * centre
    return (points - centre) * scale, matrix
