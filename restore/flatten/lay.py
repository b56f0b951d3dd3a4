"""Lay a warped sheet on the table, printed side up, and put the flat page back upright."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from restore.scan import Floats, Ints

LEVEL = 0.2  # a sheet closed to a tube has no mean normal; below this share of its area we ask its principal axes


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
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    weights = np.asarray(
        np.bincount(faces.ravel(), np.repeat(np.linalg.norm(normals, axis=1), 3), len(vertices)), dtype=float
    )
    weights = weights / max(weights.sum(), np.finfo(float).tiny)
    centre = weights @ vertices
    axes = _axes(vertices - centre, weights, normals)
    origin = centre + axes[2] * ((vertices - centre) @ axes[2]).min()
    positions = (vertices - origin) @ axes.T
    return Laid(positions, axes, origin, vertices @ axes[:2].T, weights)


def _axes(offsets: Floats, weights: Floats, normals: Floats) -> Floats:
    """(3, 3) rows right, up, out of the page; up is as near to the scanner's as the page allows."""
    mean = normals.sum(axis=0)
    if np.linalg.norm(mean) > LEVEL * np.linalg.norm(normals, axis=1).sum():
        out = mean
    else:
        _, _, principal = np.linalg.svd(offsets * np.sqrt(weights)[:, None], full_matrices=False)
        out = principal[2] * (np.sign(principal[2] @ mean) or 1.0)
    out = out / np.linalg.norm(out)
    # A page that lies before the scanner keeps the scanner's right; one seen edge-on from the side takes what is left.
    right = np.array([1.0, 0.0, 0.0]) if abs(out[0]) < 0.9 else np.array([0.0, 0.0, -np.sign(out[0])])
    right = right - out * (right @ out)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(out, right), out])


def upright(flat: Floats, laid: Laid) -> Floats:
    """Move the flat page (n, 2) mm, without scaling or mirroring, to where the scanner saw it."""
    w = laid.weights
    page, seen = flat - w @ flat, laid.seen - w @ laid.seen
    covariance = (page * w[:, None]).T @ seen
    angle = np.arctan2(covariance[0, 1] - covariance[1, 0], covariance[0, 0] + covariance[1, 1])
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return page @ turn + w @ laid.seen
