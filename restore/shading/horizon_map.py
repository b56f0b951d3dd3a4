"""Horizon map: how far a warped page hides lamps and sky from each of its own points.

A horizon map (N. Max, "Horizon mapping: shadows for bump-mapped surfaces", The Visual Computer 4, 1988) holds, for some
directions of the compass, how steeply the surface rises before a place. Any lamp is then seen or not by one look into
the map, wherever it stands.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import Any

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from restore.mesh.raster import rasterise
from restore.runtime.threads import in_bands
from restore.scan import Floats, Mask
from restore.shading.relief import Field, Relief

# Of the map: 1.9 mm apart on a page of 280 × 200 mm, as the lattice that it is drawn from; finer maps move no shadow.
MAX_NODES = 16_000
AZIMUTHS = 24  # before a straight ridge the horizon is a cosine of the azimuth: 15° between two err by 1 % of it
GROWTH = 1.1  # of the steps: a ridge that is far away may be met less exactly
_AZIMUTH = np.arange(AZIMUTHS) * (2 * np.pi / AZIMUTHS)
DIRECTIONS = np.stack([np.cos(_AZIMUTH), np.sin(_AZIMUTH)]).astype(np.float32)  # along x and y
ONWARD = DIRECTIONS.T * np.array([1, -1], np.float32)  # columns and rows of a map from node to node
NOWHERE = -1e6  # mm: no surface, no occluder
PENUMBRA = 0.03  # tangent: the half-shadow of a lamp of 3 cm at a metre


@dataclass(frozen=True, eq=False)
class HorizonMap:
    """Nodes `pitch` mm apart from corner (2,) mm (x left, y top) of the page's frame.

    slopes (rows, cols, AZIMUTHS): the tangent of the horizon's elevation, counter-clockwise from x; reaches alike:
    how many nodes away it stands. heights (rows, cols) mm, NOWHERE off the page.
    """

    corner: Floats
    pitch: float
    slopes: Field
    reaches: Field
    heights: Field

    def nodes(self, points: Field) -> Field:
        """Return the map positions (…, 2) = (col, row) of points (…, 3) mm, with fractions."""
        left, top = self.corner.astype(np.float32)
        pitch = np.float32(self.pitch)
        return np.stack([(points[..., 0] - left) / pitch, (top - points[..., 1]) / pitch], axis=-1)

    @cached_property
    def normals(self) -> Field:
        """Return unit normals (rows, cols, 3) at the nodes, NaN off the page and at its border."""
        down, right = np.gradient(np.where(self.heights == NOWHERE, np.float32(np.nan), self.heights), self.pitch)
        normals = np.dstack([-right, down, np.ones_like(down)]).astype(np.float32)
        return np.asarray(normals / np.linalg.norm(normals, axis=2, keepdims=True))

    @cached_property
    def points(self) -> Field:
        """Return the nodes, (rows, cols, 3) mm."""
        rows, cols = self.heights.shape
        x, y = self.corner[0] + self.pitch * np.arange(cols), self.corner[1] - self.pitch * np.arange(rows)
        return np.dstack([*np.meshgrid(x, y), self.heights]).astype(np.float32)

    @cached_property
    def views(self) -> tuple[Field, Field]:
        """Return the light past the horizon in each direction, and reflected.

        Light that is alike from all sides, weighted by the cosine to the normal, is integrated up to the horizon and up
        to the node's own plane: all of it is 1.
        Returns (rows, cols, AZIMUTHS) twice: the fraction of a node's light, and how much the page in front of it would
        reflect there.
        """
        normal = self.normals
        facing = normal[..., :1] * DIRECTIONS[0] + normal[..., 1:2] * DIRECTIONS[1]
        # At the edge of the page nothing stands before a place but its own plane.
        plane = -facing / normal[..., 2:]
        past, whole = (_slices(normal[..., 2:], facing, rise) for rise in (np.maximum(self.slopes, plane), plane))
        return past, whole - past

    @cached_property
    def openness(self) -> Field:
        """Return how open each node is to the light from above, 0 to 1.

        How much of the light that its slope could get a node does get, against the same for a plane of that slope
        alone, (1 + n_z) / 2. Returns (rows, cols).
        """
        fraction = self.views[0].sum(axis=2) / ((1 + self.normals[..., 2]) / 2)
        return np.asarray(np.clip(fill_nearest(fraction, np.isfinite(fraction)), 0, 1), dtype=np.float32)


def _slices(upright: Field, facing: Field, rise: Field) -> Field:
    """Return the light from above a rise, in slices of azimuth.

    With the polar angle p of the horizon, tan p = 1 / rise: sin² p, and sin 2p / 2.
    upright, facing: the normal's parts along z and the azimuth.
    """
    squared = 1 / (1 + rise * rise)
    slices = upright * squared / 2 + facing * ((np.pi / 2 - np.arctan(rise)) - rise * squared) / 2
    return np.asarray(slices * np.float32(2 / AZIMUTHS))


def fill_nearest(field: NDArray[Any], known: Mask) -> NDArray[Any]:
    """A field (rows, cols, …) with the nearest known value wherever it is not known."""
    if known.all():
        return field
    if not known.any():
        return np.ones_like(field)
    _, nearest = cv2.distanceTransformWithLabels(
        (~known).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    place = np.zeros(int(nearest.max()) + 1, np.int64)
    place[nearest[known]] = np.flatnonzero(known)
    filled = field.copy()
    filled[~known] = field.reshape(-1, *field.shape[2:])[place[nearest[~known]]]
    return filled


def horizon_map(relief: Relief) -> HorizonMap:
    """Horizon map of a relief on a grid of at most MAX_NODES nodes."""
    low, high = relief.vertices[:, :2].min(axis=0), relief.vertices[:, :2].max(axis=0)
    pitch = float(np.sqrt(np.prod(high - low) / MAX_NODES))
    corner = np.array([low[0], high[1]])
    xy = (relief.vertices[:, :2] - corner) * [1 / pitch, -1 / pitch]
    width, height = (ceil(extent / pitch) + 1 for extent in high - low)
    heights = rasterise(xy, relief.faces, relief.vertices[:, 2:], height, width)[..., 0]
    known = np.isfinite(heights)
    heights = np.where(known, heights, np.float32(NOWHERE))
    slopes, reaches = np.zeros((2, *heights.shape, AZIMUTHS), np.float32)
    steps = _steps(max(heights.shape))
    in_bands(lambda rows: _horizon(heights, ONWARD, steps, pitch, rows.start, slopes[rows], reaches[rows]), height)
    return HorizonMap(corner, pitch, fill_nearest(slopes, known), reaches, heights)


def _steps(longest: int) -> Field:
    """Return the distances (k,) to look at, in nodes, up to the longest."""
    steps = [1.0]
    while steps[-1] < np.hypot(longest, longest):
        steps.append(max(steps[-1] + 1.0, steps[-1] * GROWTH))
    return np.array(steps, np.float32)


@numba.njit(cache=True, nogil=True)
def _horizon(
    heights: Field, ways: Field, steps: Field, pitch: float, first: int, slopes: Field, reaches: Field
) -> None:
    """Write slopes and distances of the horizon, rows from `first` on, into (k, cols, ways).

    All nodes of a row are advanced by the same reach at once, so that the heights read are contiguous in memory.
    """
    rows, cols = heights.shape
    one = np.float32(1)
    for row in range(first, first + len(slopes)):
        for a in range(len(ways)):
            steepest = np.full(cols, np.float32(-1e3))
            farthest = np.zeros(cols, np.float32)
            for reach in steps:
                x, y = ways[a, 0] * reach, row + ways[a, 1] * reach
                right, i = int(np.floor(x)), int(np.floor(y))
                start, stop = max(0, -right), min(cols, cols - 1 - right)
                if start >= stop or not 0 <= i < rows - 1:
                    break
                u, v, nearness = np.float32(x - right), np.float32(y - i), one / (reach * np.float32(pitch))
                here, steep, far = heights[row, start:stop], steepest[start:stop], farthest[start:stop]
                upper, lower = heights[i, start + right :], heights[i + 1, start + right :]
                for k in range(stop - start):
                    above = (one - u) * upper[k] + u * upper[k + 1]
                    below = (one - u) * lower[k] + u * lower[k + 1]
                    rise = ((one - v) * above + v * below - here[k]) * nearness
                    far[k] = reach if rise > steep[k] else far[k]
                    steep[k] = max(steep[k], rise)
            slopes[row - first, :, a], reaches[row - first, :, a] = steepest, farthest


@numba.njit(cache=True)
def in_sight(slopes: Field, col: float, row: float, x: float, y: float, z: float) -> float:
    """Return how much of a lamp is seen from a node, 0 to 1.

    The lamp is in the direction (x, y, z); slopes: the map's.
    """
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
    # Of a lamp whose middle is at the horizon half is seen.
    return min(max((z - horizon * level) / (PENUMBRA * level + 1e-9) + 0.5, 0.0), 1.0)
