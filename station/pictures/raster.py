"""Which triangle a pixel shows, and where in it: a z-buffer."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from restore.scan import Floats, Ints, Mask

SLIVER = 1e-9  # twice the area in pixels below which a triangle is seen from its edge
HAIR = 1e-6  # no pixel may fall between two triangles


class Visible(NamedTuple):
    """face (h, w) index of the triangle that a pixel shows, −1 for none; weight (h, w, 3) of its three corners."""

    face: NDArray[np.int32]
    weight: Floats

    @property
    def covered(self) -> Mask:
        """(h, w) bool, True where a triangle is seen."""
        return self.face >= 0

    def interpolate(self, values: Floats, faces: Ints) -> Floats:
        """Values per vertex (n, k) → per covered pixel (p, k), in the order of `covered`."""
        corners = values[faces[self.face[self.covered]]]
        mixed: Floats = np.einsum("pc,pck->pk", self.weight[self.covered], corners)
        return mixed


def rasterise(xy: Floats, depth: Floats, faces: Ints, *, height: int, width: int) -> Visible:
    """Cast triangles on a picture.

    xy (n, 2) pixels, x right and y down, centres at whole numbers; depth (n,) > 0, distance from the eye along the
    line of sight; faces (m, 3). The nearest triangle wins; weights are true in space (perspective-correct).
    """
    face, weight = _rasterise(xy, 1.0 / depth, faces, height, width)
    return Visible(face, weight)


@numba.njit(cache=True)
def _rasterise(
    xy: Floats, nearness: Floats, faces: Ints, height: int, width: int
) -> tuple[NDArray[np.int32], Floats]:  # pragma: no cover - compiled
    face = np.full((height, width), -1, np.int32)
    weight = np.zeros((height, width, 3))
    nearest = np.zeros((height, width))
    for f in range(len(faces)):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        ax, ay, bx, by, cx, cy = xy[i, 0], xy[i, 1], xy[j, 0], xy[j, 1], xy[k, 0], xy[k, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < SLIVER:
            continue
        for row in range(max(0, int(np.ceil(min(ay, by, cy)))), min(height - 1, int(np.floor(max(ay, by, cy)))) + 1):
            for col in range(max(0, int(np.ceil(min(ax, bx, cx)))), min(width - 1, int(np.floor(max(ax, bx, cx)))) + 1):
                v = ((col - ax) * (cy - ay) - (row - ay) * (cx - ax)) / area
                w = ((bx - ax) * (row - ay) - (by - ay) * (col - ax)) / area
                u = 1.0 - v - w
                if u < -HAIR or v < -HAIR or w < -HAIR:
                    continue
                # 1/depth is linear in the picture, depth is not.
                near = u * nearness[i] + v * nearness[j] + w * nearness[k]
                if near <= nearest[row, col]:
                    continue
                nearest[row, col] = near
                face[row, col] = f
                weight[row, col, 0] = u * nearness[i] / near
                weight[row, col, 1] = v * nearness[j] / near
                weight[row, col, 2] = w * nearness[k] / near
    return face, weight
