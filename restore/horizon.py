"""What a warped page hides from its own light: the horizon seen from every place on it.

A horizon map (N. Max, "Horizon mapping: shadows for bump-mapped surfaces", The Visual Computer 4, 1988) holds, for
some directions of the compass, how steeply the surface rises before a place. Any lamp is then seen or not by one look
into the map, wherever it stands.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from restore.raster import rasterise
from restore.relief import Field, Relief
from restore.scan import Floats, Mask

MAX_NODES = 25_000  # of the map: 1.5 mm apart on a page of 280 × 200 mm; finer maps cost time and move no shadow
AZIMUTHS = 24  # before a straight ridge the horizon is a cosine of the azimuth: 15° between two err by 1 % of it
GROWTH = 1.15  # of the steps: a ridge that is far away may be met less exactly
NOWHERE = -1e6  # mm: no surface, and nothing that hides light
PENUMBRA = 0.05  # tangent: the half-shadow of a lamp of 5 cm at a metre


@dataclass(frozen=True, eq=False)
class HorizonMap:
    """Nodes `pitch` mm apart from corner (2,) mm (x left, y top) of the page's frame.

    slopes (rows, cols, AZIMUTHS): the tangent of the horizon's elevation, counter-clockwise from x.
    heights (rows, cols) mm, NOWHERE off the page.
    """

    corner: Floats
    pitch: float
    slopes: Field
    heights: Field

    def nodes(self, points: Field) -> Field:
        """(…, 2) = (col, row) in the map, as fractions, of points (…, 3) mm."""
        return np.asarray((points[..., :2] - self.corner) * [1 / self.pitch, -1 / self.pitch], dtype=np.float32)

    def openness(self) -> Field:
        """(rows, cols) 0 to 1: how much of the light from above that its slope could get a node does get.

        Light from all sides, weighed by the cosine to the normal and integrated up to the horizon, against the same
        for a plane of that slope alone, (1 + n_z) / 2.
        """
        down, right = np.gradient(np.where(self.heights == NOWHERE, np.nan, self.heights), self.pitch)
        normal = np.dstack([-right, down, np.ones_like(down)])
        normal /= np.linalg.norm(normal, axis=2, keepdims=True)
        azimuth = 2 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
        facing = normal[..., :1] * np.cos(azimuth) + normal[..., 1:2] * np.sin(azimuth)
        # At the edge of the page nothing stands before a place but its own plane.
        polar = np.pi / 2 - np.arctan(np.maximum(self.slopes, -facing / normal[..., 2:]))
        slices = normal[..., 2:] * np.sin(polar) ** 2 / 2 + facing * (polar / 2 - np.sin(2 * polar) / 4)
        share = slices.sum(axis=2) * (2 / AZIMUTHS) / ((1 + normal[..., 2]) / 2)
        return np.asarray(np.clip(spread(share, np.isfinite(share)), 0, 1), dtype=np.float32)


def spread(field: NDArray[Any], known: Mask) -> NDArray[Any]:
    """A field (rows, cols, …) with the nearest known value wherever it is not known."""
    if not known.any():
        return np.ones_like(field)
    rows, cols = distance_transform_edt(~known, return_distances=False, return_indices=True)
    return np.asarray(field[rows, cols])


def horizon_map(relief: Relief) -> HorizonMap:
    """Look round from a grid of places on the page."""
    low, high = relief.vertices[:, :2].min(axis=0), relief.vertices[:, :2].max(axis=0)
    pitch = float(np.sqrt(np.prod(high - low) / MAX_NODES))
    corner = np.array([low[0], high[1]])
    xy = (relief.vertices[:, :2] - corner) * [1 / pitch, -1 / pitch]
    width, height = (ceil(extent / pitch) + 1 for extent in high - low)
    heights = rasterise(xy, relief.faces, relief.vertices[:, 2:], height, width)[..., 0]
    known = np.isfinite(heights)
    heights = np.where(known, heights, np.float32(NOWHERE))
    azimuth = 2 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    steps = np.stack([np.cos(azimuth), -np.sin(azimuth)], axis=1)
    return HorizonMap(corner, pitch, spread(_horizon(heights, steps, pitch), known), heights)


@numba.njit(cache=True)
def _horizon(heights: Field, steps: Floats, pitch: float) -> Field:
    rows, cols = heights.shape
    slopes = np.full((rows, cols, len(steps)), -1e3, np.float32)
    top = heights.max()
    for row in range(rows):
        for col in range(cols):
            here = heights[row, col]
            if here == NOWHERE:
                slopes[row, col, :] = 0.0
                continue
            for a in range(len(steps)):
                steepest, reach = -1e3, 1.0
                while (top - here) > steepest * reach * pitch:
                    x, y = col + steps[a, 0] * reach, row + steps[a, 1] * reach
                    j, i = int(np.floor(x)), int(np.floor(y))
                    if i < 0 or j < 0 or i + 1 >= rows or j + 1 >= cols:
                        break
                    u, v = x - j, y - i
                    upper = (1 - u) * heights[i, j] + u * heights[i, j + 1]
                    lower = (1 - u) * heights[i + 1, j] + u * heights[i + 1, j + 1]
                    steepest = max(steepest, ((1 - v) * upper + v * lower - here) / (reach * pitch))
                    reach = max(reach + 1.0, reach * GROWTH)
                slopes[row, col, a] = max(steepest, -1e3)
    return slopes


@numba.njit(cache=True)
def in_sight(slopes: Field, col: float, row: float, x: float, y: float, z: float) -> float:
    """How much of a lamp in the direction (x, y, z) is seen from a node of a map of slopes: 0 to 1."""
    height, width, count = slopes.shape
    level = np.sqrt(x * x + y * y)
    col, row = min(max(col, 0.0), width - 1.001), min(max(row, 0.0), height - 1.001)
    turn = np.arctan2(y, x) / (2 * np.pi) * count
    j, i, whole = int(col), int(row), int(np.floor(turn))
    u, v, w = col - j, row - i, turn - whole
    a, b = whole % count, (whole + 1) % count
    horizon = 0.0
    for di in range(2):
        for dj in range(2):
            weight = (v if di else 1 - v) * (u if dj else 1 - u)
            horizon += weight * ((1 - w) * slopes[i + di, j + dj, a] + w * slopes[i + di, j + dj, b])
    return min(max((z - horizon * level) / (PENUMBRA * level + 1e-9) + 1.0, 0.0), 1.0)
