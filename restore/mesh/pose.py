"""The pose of a warped sheet over the table z = 0, printed side up, and of the flat page as the scanner saw it."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from restore.mesh.measures import face_normals
from restore.numerics.limits import TINY
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
    """(3, 3) rows right, up and out of the page (unit vector): up is as near to the scanner's as the page allows.

    A page that lies before the scanner keeps the scanner's right; one seen edge-on from the side takes what is left.
    """
    right = np.array([1.0, 0.0, 0.0] if abs(out[0]) < EDGE_ON else [0.0, 0.0, -np.sign(out[0])])
    right -= (right @ out) * out
    right /= sqrt(right @ right)
    return np.stack([right, np.cross(out, right), out])


def _least_extent(offsets: Floats, weights: Floats, mean: Floats) -> Floats:
    """(3,) the principal axis along which offsets (n, 3) spread least, to the side of the mean normal (3,)."""
    _, principal = np.linalg.eigh(offsets.T @ (offsets * weights[:, None]))
    return np.asarray(principal[:, 0] * (np.sign(principal[:, 0] @ mean) or 1.0))


def move_upright(flat: Floats, posed: PosedSheet) -> Floats:
    """Flat positions (n, 2) mm turned and shifted, not scaled or mirrored, to nearest where the scanner saw them."""
    here, there = ((posed.weights[:, None] * part).sum(axis=0) for part in (flat, posed.seen))  # @ starts threads
    offsets, wanted = (part[:, 0] + 1.0j * part[:, 1] for part in (flat - here, posed.seen - there))
    turned = offsets * np.exp(1.0j * np.angle(np.vdot(posed.weights * offsets, wanted)))
    return np.stack([turned.real, turned.imag], axis=1) + there
