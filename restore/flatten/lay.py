"""Lay a warped sheet on the table, printed side up, and put the flat page back upright."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numba
import numpy as np

from restore.scan import Floats, Ints
from restore.strain import normals_of

LEVEL = 0.2  # a sheet closed to a tube has no mean normal; below this share of its area we ask its principal axes
TINY = 1e-300  # keeps a sheet without area from dividing by zero


@dataclass(frozen=True, eq=False)
class Laid:
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


def lay(vertices: Floats, faces: Ints) -> Laid:
    """Turn a connected sheet, vertices (n, 3) mm, printed side up over the table.

    The printed side is where its faces (m, 3) run counter-clockwise.
    """
    weights, mean = _weigh(vertices, faces)
    centre = weights @ vertices
    axes = _axes(vertices - centre, weights, mean)
    origin = centre + axes[2] * ((vertices - centre) @ axes[2]).min()
    positions = (vertices - origin) @ axes.T
    return Laid(positions, axes, origin, vertices @ axes[:2].T, weights)


@numba.njit(cache=True)
def _weigh(vertices: Floats, faces: Ints) -> tuple[Floats, Floats]:
    """The share of the area that each vertex (n, 3) stands for, and the mean normal (3,) of faces (m, 3) by area."""
    weights, mean = np.zeros(len(vertices)), np.zeros(3)
    normals = normals_of(vertices, faces)
    for f in range(len(faces)):
        area = sqrt(normals[f, 0] ** 2 + normals[f, 1] ** 2 + normals[f, 2] ** 2)
        for k in range(3):
            weights[faces[f, k]] += area
            mean[k] += normals[f, k]
    total = max(weights.sum(), TINY)
    return weights / total, mean / (total / 3.0)


def _axes(offsets: Floats, weights: Floats, mean: Floats) -> Floats:
    """(3, 3) rows right, up, out of the page; up is as near to the scanner's as the page allows."""
    if sqrt(mean @ mean) > LEVEL:
        out = mean
    else:
        _, _, principal = np.linalg.svd(offsets * np.sqrt(weights)[:, None], full_matrices=False)
        out = principal[2] * (np.sign(principal[2] @ mean) or 1.0)
    out = out / sqrt(out @ out)
    # A page that lies before the scanner keeps the scanner's right; one seen edge-on from the side takes what is left.
    right = np.array([1.0, 0.0, 0.0]) if abs(out[0]) < 0.9 else np.array([0.0, 0.0, -np.sign(out[0])])
    right = right - out * (right @ out)
    right /= sqrt(right @ right)
    up = [out[k - 2] * right[k - 1] - out[k - 1] * right[k - 2] for k in range(3)]
    return np.array([right, up, out])


def upright(flat: Floats, laid: Laid) -> Floats:
    """Move the flat page (n, 2) mm, without scaling or mirroring, to where the scanner saw it."""
    w = laid.weights
    page, seen = flat - w @ flat, laid.seen - w @ laid.seen
    covariance = (page * w[:, None]).T @ seen
    angle = np.arctan2(covariance[0, 1] - covariance[1, 0], covariance[0, 0] + covariance[1, 1])
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return page @ turn + w @ laid.seen
