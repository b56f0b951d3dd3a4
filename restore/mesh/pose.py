"""Pose of a warped sheet over the table z = 0, and of the flat page.

The sheet is printed side up, the page as the scanner saw it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from restore.mesh.measures import face_normals
from restore.numerics.limits import TINY
from restore.scan import Floats, Ints

LEVEL = 0.2  # a sheet closed to a tube has no mean normal; below this fraction of its area its principal axes decide
EDGE_ON = 0.9  # cosine of the page's normal with the scanner's right


@dataclass(frozen=True, eq=False)
class PosedSheet:
    """Sheet over the table z = 0.

    positions: (n, 3) mm; the origin is under the centre of the sheet, its lowest point on the table.
    axes: (3, 3) rows right, up and out of the page; origin (3,) mm: positions = (vertices − origin) @ axes.T.
    seen: (n, 2) mm, where the scanner saw each vertex, x right, y up. It defines upright, and where the page lay.
    weights: (n,), fraction of the area that each vertex stands for.
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
    normals = face_normals(vertices, faces)
    areas = np.linalg.norm(normals, axis=1)
    total = max(float(areas.sum()), TINY)
    weights = np.bincount(faces.ravel(), np.repeat(areas, 3), len(vertices)) / (3.0 * total)
    mean = normals.sum(axis=0) / total
    centre = weights @ vertices
    out = mean if sqrt(mean @ mean) > LEVEL else _least_extent(vertices - centre, weights, mean)
    axes = _axes(out / sqrt(out @ out))
    positions = (vertices - centre) @ axes.T
    lowest = positions[:, 2].min()
    positions[:, 2] -= lowest
    return PosedSheet(positions, axes, centre + lowest * axes[2], vertices @ axes[:2].T, weights)


def _axes(out: Floats) -> Floats:
    """Return the axes (3, 3): rows right, up and out of the page.

    Up is as near to the scanner's as the page allows. A page that faces the scanner keeps the scanner's right; one seen
    edge-on from the side takes what is left.
    out: (3,) unit vector.
    """
    right = np.array([1.0, 0.0, 0.0] if abs(out[0]) < EDGE_ON else [0.0, 0.0, -np.sign(out[0])])
    right -= (right @ out) * out
    right /= sqrt(right @ right)
    return np.stack([right, np.cross(out, right), out])


def _least_extent(offsets: Floats, weights: Floats, mean: Floats) -> Floats:
    """Return the principal axis (3,) of least spread.

    offsets: (n, 3).
    mean: (3,), mean normal, whose side the axis takes.
    """
    _, principal = np.linalg.eigh(offsets.T @ (offsets * weights[:, None]))
    return np.asarray(principal[:, 0] * (np.sign(principal[:, 0] @ mean) or 1.0))


def move_upright(flat: Floats, posed: PosedSheet) -> Floats:
    """Return the page rotated and shifted to where the scanner saw it.

    It is not scaled or mirrored.
    flat: (n, 2) mm.
    """
    here, there = ((posed.weights[:, None] * part).sum(axis=0) for part in (flat, posed.seen))  # @ starts threads
    offsets, wanted = (part[:, 0] + 1.0j * part[:, 1] for part in (flat - here, posed.seen - there))
    turned = offsets * np.exp(1.0j * np.angle(np.vdot(posed.weights * offsets, wanted)))
    return np.stack([turned.real, turned.imag], axis=1) + there
