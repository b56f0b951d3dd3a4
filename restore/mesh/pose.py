"""The pose of a warped sheet over the table z = 0, printed side up, and of the flat page as the scanner saw it."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, sin, sqrt

import numba
import numpy as np

from restore.mesh.measures import face_normals
from restore.numerics import TINY
from restore.scan import Floats, Ints

LEVEL = 0.2  # a sheet closed to a tube has no mean normal; below this share of its area we ask its principal axes
EDGE_ON = 0.9  # cosine of the page's normal with the scanner's right


@dataclass(frozen=True, eq=False)
class PosedSheet:
    """A sheet over the table z = 0.

    positions (n, 3) mm; the origin lies under the centre of the sheet, its lowest point on the table.
    axes      (3, 3) rows right, up and out of the page; origin (3,) mm: positions = (vertices − origin) @ axes.T.
    seen      (n, 2) mm: where the scanner saw each vertex, x right, y up. It tells upright, and where the page lay.
    weights   (n,) share of the area that each vertex stands for.
    """

    positions: Floats
    axes: Floats
    origin: Floats
    seen: Floats
    weights: Floats


def pose_on_table(vertices: Floats, faces: Ints) -> PosedSheet:
    """A connected sheet, vertices (n, 3) mm, turned printed side up over the table.

    The printed side is where its faces (m, 3) run counter-clockwise.
    """
    weights, mean = _weigh(vertices, faces)
    centre = (weights[:, None] * vertices).sum(axis=0)
    out = mean if sqrt(mean @ mean) > LEVEL else _least_extent(vertices - centre, weights, mean)
    positions, axes, origin, seen = _put(vertices, centre, out / sqrt(out @ out))
    return PosedSheet(positions, axes, origin, seen, weights)


@numba.njit(cache=True)
def _weigh(vertices: Floats, faces: Ints) -> tuple[Floats, Floats]:
    """The share of the area that each vertex (n, 3) stands for, and the mean normal (3,) of faces (m, 3) by area."""
    weights, mean = np.zeros(len(vertices)), np.zeros(3)
    normals = face_normals(vertices, faces)
    for f in range(len(faces)):
        area = sqrt(normals[f, 0] ** 2 + normals[f, 1] ** 2 + normals[f, 2] ** 2)
        for k in range(3):
            weights[faces[f, k]] += area
            mean[k] += normals[f, k]
    total = max(weights.sum(), TINY)
    return weights / total, mean / (total / 3.0)


def _least_extent(offsets: Floats, weights: Floats, mean: Floats) -> Floats:
    """(3,) the principal axis along which offsets (n, 3) spread least, to the side of the mean normal (3,)."""
    _, principal = np.linalg.eigh(offsets.T @ (offsets * weights[:, None]))
    return np.asarray(principal[:, 0] * (np.sign(principal[:, 0] @ mean) or 1.0))


@numba.njit(cache=True)
def _put(vertices: Floats, centre: Floats, out: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Positions, axes, origin and where the scanner saw them, of vertices (n, 3) about a centre (3,); out (3,) is up.

    Up on the page is as near to the scanner's up as the page allows.
    """
    # A page that lies before the scanner keeps the scanner's right; one seen edge-on from the side takes what is left.
    right = np.zeros(3)
    if abs(out[0]) < EDGE_ON:
        right[0] = 1.0
    else:
        right[2] = -np.sign(out[0])
    right -= out * (right * out).sum()
    right /= sqrt((right * right).sum())
    axes = np.empty((3, 3))
    axes[0], axes[2] = right, out
    for k in range(3):
        axes[1, k] = out[k - 2] * right[k - 1] - out[k - 1] * right[k - 2]
    positions, seen = np.zeros_like(vertices), np.zeros((len(vertices), 2))
    for i in range(len(vertices)):
        for row in range(3):
            for k in range(3):
                positions[i, row] += axes[row, k] * (vertices[i, k] - centre[k])
                if row < 2:
                    seen[i, row] += axes[row, k] * vertices[i, k]
    lowest = positions[:, 2].min()
    positions[:, 2] -= lowest
    return positions, axes, centre + lowest * out, seen


def move_upright(flat: Floats, posed: PosedSheet) -> Floats:
    """Move the flat page (n, 2) mm, without scaling or mirroring, to where the scanner saw it."""
    return _moved(flat, posed.seen, posed.weights)


@numba.njit(cache=True)
def _moved(flat: Floats, seen: Floats, weights: Floats) -> Floats:
    """Flat positions (n, 2) turned and shifted to where they lie nearest to seen (n, 2), by weight."""
    here, there, crossed, common = np.zeros(2), np.zeros(2), 0.0, 0.0
    for i in range(len(flat)):
        for axis in range(2):
            here[axis] += weights[i] * flat[i, axis]
            there[axis] += weights[i] * seen[i, axis]
    for i in range(len(flat)):
        x, y, u, v = flat[i, 0] - here[0], flat[i, 1] - here[1], seen[i, 0] - there[0], seen[i, 1] - there[1]
        common += weights[i] * (x * u + y * v)
        crossed += weights[i] * (x * v - y * u)
    angle = atan2(crossed, common)
    moved = np.empty_like(flat)
    for i in range(len(flat)):
        x, y = flat[i, 0] - here[0], flat[i, 1] - here[1]
        moved[i, 0] = cos(angle) * x - sin(angle) * y + there[0]
        moved[i, 1] = sin(angle) * x + cos(angle) * y + there[1]
    return moved
