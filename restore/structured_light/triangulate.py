"""Depth along the camera's lines of sight from projector pixels."""

from __future__ import annotations

import numpy as np

from restore.scan import Floats
from restore.structured_light.rig import Rig


def triangulate(rig: Rig, tangents: Floats, found: Floats) -> tuple[Floats, Floats]:
    """Triangulate camera lines of sight with projector pixels.

    A point at depth s lies at s · a + b in the projector's frame; that its column and its row are those found are two
    equations for s. It is their least-squares solution; the residual is signed, across the epipolar line.
    tangents: (…, 2), of the camera's lines of sight.
    found: (…, 2), projector pixels seen along them, NaN where unknown.
    Returns depth (…) mm along the camera's axis, and the epipolar residual (…) in projector pixels.
    """
    shape = tangents.shape[:-1]
    depth, residual = np.full(shape, np.nan), np.full(shape, np.nan)
    known = np.isfinite(found).all(axis=-1)
    if not known.any():
        return depth, residual
    seen = np.column_stack([tangents[known], np.ones(int(known.sum()))])
    a, b = seen @ rig.rotation.T, rig.shift
    aim = rig.lamp.tangents(found[known])
    slope = a[:, :2] - aim * a[:, 2:]
    offset = b[:2] - aim * b[2]
    square = np.einsum("ij,ij->i", slope, slope)
    s = -np.einsum("ij,ij->i", slope, offset) / square
    depth[known] = s
    # What is left of the two equations is perpendicular to `slope`; over the depth in the projector it is a tangent.
    across = slope[:, 0] * offset[:, 1] - slope[:, 1] * offset[:, 0]
    focal = float(np.sqrt(rig.lamp.matrix[0, 0] * rig.lamp.matrix[1, 1]))
    residual[known] = focal * across / np.sqrt(square) / (a[:, 2] * s + b[2])
    return depth, residual
