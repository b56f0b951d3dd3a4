"""How far the vertices of a mesh are apart along the surface that it samples.

The straight edge is too short over a bend, far too short over a crease between its ends, and too long between vertices
that noise has moved. The patches round both ends tell the length of the way between them.
"""

from __future__ import annotations

import numpy as np

from restore.flatten.jets import Jets, fit_jets
from restore.scan import Floats, Ints

PROBES = 100  # vertices that tell the noise
SHRUNK = 0.87  # of the noise is left when a patch passes between a vertex and its neighbours
LEAST_NOISE = 1e-7  # of the page's size: no file holds more digits
CREASE = 0.1  # radians, 6°: a turn that the curvature of both patches does not explain is a crease
CREASE_SHARE = 0.35  # of the whole turn: the rest of it may be curvature
STEEPEST = 1.35  # radians, 77°: beyond, the patches of two ends do not meet between them
MOST_STRETCH = 2.6  # of the straight edge, over a crease of twice 67°


def surface_lengths(vertices: Floats, faces: Ints, edges: Ints) -> Floats:
    """(e,) mm between the ends of edges (e, 2), along the surface through vertices (n, 3) mm of faces (m, 3)."""
    noise = noise_of(vertices, faces, edges)
    jets = fit_jets(vertices, faces, edges, np.arange(len(vertices)), noise)
    points = vertices + jets.normals * jets.offsets[:, None]
    way = points[edges[:, 1]] - points[edges[:, 0]]
    chord = np.maximum(np.linalg.norm(way, axis=1), np.finfo(float).tiny)
    return chord * np.clip(_stretch(jets, edges, way / chord[:, None], chord), 1.0, MOST_STRETCH)


def noise_of(vertices: Floats, faces: Ints, edges: Ints) -> float:
    """Standard deviation of the vertices off the surface, mm, from patches that are not tied to their vertex."""
    size = float(np.ptp(vertices, axis=0).max())
    chosen = np.arange(0, len(vertices), max(len(vertices) // PROBES, 1))
    offsets = fit_jets(vertices, faces, edges, chosen, size).offsets[chosen]
    return max(float(1.4826 * np.median(np.abs(offsets))) / SHRUNK, LEAST_NOISE * size)


def _stretch(jets: Jets, edges: Ints, way: Floats, chord: Floats) -> Floats:
    """(e,) length along the surface over the straight distance; way (e, 3) unit vectors, chord (e,) mm.

    On a smooth surface the section over the edge is the cubic with the slopes of both ends. Over a crease it is the
    broken line of their tangents.
    """
    start, end = edges.T
    rise = -np.einsum("ij,ij->i", jets.normals[start], way)
    sink = np.einsum("ij,ij->i", jets.normals[end], way)
    rise, sink = (np.clip(np.arcsin(np.clip(a, -1, 1)), -STEEPEST, STEEPEST) for a in (rise, sink))
    curvature = np.einsum("ij,ij->i", np.matmul(jets.forms[start] + jets.forms[end], way[:, :, None])[..., 0], way) / 2
    turn = np.abs(rise + sink)
    unexplained = turn - np.abs(curvature) * chord
    creased = (unexplained > CREASE) & (unexplained > CREASE_SHARE * turn) & (rise * sink > 0)
    smooth = 1.0 + (2 * rise**2 + rise * sink + 2 * sink**2) / 30.0
    turned = np.where(creased, turn, 1.0)
    broken = (np.sin(np.abs(rise)) + np.sin(np.abs(sink))) / np.maximum(np.sin(turned), np.finfo(float).eps)
    return np.where(creased, broken, smooth)
