"""Rotate a scan by quarters of a turn about the optical axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from restore.scan import RangeScan


def rotate_quarters(scan: RangeScan, quarters: int) -> RangeScan:
    """Rotate a scan's grid, picture and points counter-clockwise by quarter turns.

    Nothing is resampled: rows and columns are exchanged or reversed, and the points rotate about the z axis.
    """
    if quarters % 4 == 0:
        return scan
    points, texture_xy = np.rot90(scan.points, quarters), np.rot90(scan.texture_xy, quarters)
    texture = scan.texture
    for _ in range(quarters % 4):
        x, y, z = np.moveaxis(points, -1, 0)
        points = np.stack([-y, x, z], axis=-1)
        if texture is not None:
            right = texture.shape[1] - 1  # (x, y) of the picture goes to (y, right − x)
            texture_xy = np.stack([texture_xy[..., 1], right - texture_xy[..., 0]], axis=-1)
            texture = np.ascontiguousarray(np.rot90(texture))
    return replace(scan, points=points, texture=texture, texture_xy=texture_xy)
