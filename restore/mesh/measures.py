"""Measures of a mesh and its flattening: lengths, areas, normals, strain."""

from __future__ import annotations

from math import acos, sqrt

import numba
import numpy as np

from restore.mesh.adjacency import Sides
from restore.numerics.limits import TINY
from restore.scan import Floats, Ints

MIN_HEIGHT_RATIO = 1e-4  # of the base: least height of a face; the weights of a thinner one would have no bound


@numba.njit(cache=True)
def straight_lengths(vertices: Floats, edges: Ints) -> Floats:
    """(e,) mm: straight distances between the ends of edges (e, 2), for vertices (n, 3) or flat positions (n, 2) mm."""
    lengths = np.empty(len(edges))
    for k in range(len(edges)):
        squared = 0.0
        for axis in range(vertices.shape[1]):
            squared += (vertices[edges[k, 0], axis] - vertices[edges[k, 1], axis]) ** 2
        lengths[k] = sqrt(squared)
    return lengths


def edge_strain(flat: Floats, edges: Ints, lengths: Floats) -> Floats:
    """(e,) relative change of length of edges (e, 2) from lengths (e,) mm on the surface to flat (n, 2) mm."""
    return np.asarray(straight_lengths(flat, edges) / lengths - 1.0)


def face_shapes(
    faces: Ints, edges: Ints, lengths: Floats, min_height_ratio: float = MIN_HEIGHT_RATIO
) -> tuple[Floats, Floats, Floats]:
    """base, along and height, each (m,) mm: face by face the corners are (0, 0), (base, 0) and (along, height).

    No height is less than min_height_ratio × base: over a crease three lengths may violate the triangle inequality.
    """
    base, near, far = (lengths_between(faces[:, a], faces[:, b], edges, lengths) for a, b in ((0, 1), (0, 2), (1, 2)))
    along = (base**2 + near**2 - far**2) / (2.0 * base)
    return base, along, np.sqrt(np.maximum(near**2 - along**2, (min_height_ratio * base) ** 2))


def lengths_between(a: Ints, b: Ints, edges: Ints, lengths: Floats) -> Floats:
    """(k,) the lengths of the edges that join vertices a (k,) and b (k,); edges (e, 2) in ascending order."""
    count = edges.max() + 1
    keys = edges[:, 0] * count + edges[:, 1]
    found: Floats = lengths[np.searchsorted(keys, np.minimum(a, b) * count + np.maximum(a, b))]
    return found


@numba.njit(cache=True)
def corner_angles(faces: Ints, sides: Sides, lengths: Floats) -> Floats:
    """(3·m,) rad: the angles at the corners of faces (m, 3), row by row, by the lengths (e,) of their sides.

    0 for all corners of a face that names a vertex twice.
    """
    angles = np.zeros(3 * len(faces))
    for corner in range(len(angles)):
        first = corner - corner % 3
        out, far, back = sides.edge[corner], sides.edge[first + (corner + 1) % 3], sides.edge[first + (corner + 2) % 3]
        if out < 0 or far < 0 or back < 0:
            continue
        a, b, c = lengths[out], lengths[back], lengths[far]
        cosine = (a * a + b * b - c * c) / (2.0 * a * b + TINY)
        angles[corner] = acos(min(max(cosine, -1.0), 1.0))
    return angles


@numba.njit(cache=True)
def signed_areas(flat: Floats, faces: Ints) -> Floats:
    """(m,) mm², negative where a face is flipped."""
    areas = np.empty(len(faces))
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ux, uy = flat[b, 0] - flat[a, 0], flat[b, 1] - flat[a, 1]
        vx, vy = flat[c, 0] - flat[a, 0], flat[c, 1] - flat[a, 1]
        areas[f] = 0.5 * (ux * vy - uy * vx)
    return areas


@numba.njit(cache=True)
def flipped_faces(flat: Floats, faces: Ints) -> int:
    """The number of inverted faces (m, 3) over flat (n, 2): those of the orientation with less area.

    A face without area is not inverted.
    """
    areas = signed_areas(flat, faces)
    return int((areas < 0.0).sum() if areas.sum() >= 0.0 else (areas > 0.0).sum())


@numba.njit(cache=True)
def face_normals(vertices: Floats, faces: Ints) -> Floats:
    """(m, 3) normals of faces (m, 3) over vertices (n, 3) mm, twice as long as their areas."""
    first = vertices[faces[:, 0]]
    return np.cross(vertices[faces[:, 1]] - first, vertices[faces[:, 2]] - first)


@numba.njit(cache=True)
def vertex_normals(vertices: Floats, faces: Ints) -> Floats:
    """(n, 3) unit normals: the mean over the faces (m, 3) round a vertex, weighted by area."""
    return _mean_normals(face_normals(vertices, faces), faces, len(vertices))


@numba.njit(cache=True)
def face_signs(vertices: Floats, faces: Ints, known: Floats | None = None) -> Floats:
    """(m,) −1 where a face is folded over in space, as decimators leave them: it runs against its corners' normals.

    vertices (n, 3), faces (m, 3). The normal of a corner is the mean of its faces, weighed by area and by known signs
    (m,), small where one is hardly known; or by area alone, and then once more with the signs that are found.
    """
    planes, signs = face_normals(vertices, faces), np.ones(len(faces)) if known is None else known.copy()
    for _ in range(2 if known is None else 1):
        normals = _mean_normals(planes * signs.reshape(-1, 1), faces, len(vertices))
        for f in range(len(faces)):
            along = 0.0
            for i in faces[f]:
                along += planes[f, 0] * normals[i, 0] + planes[f, 1] * normals[i, 1] + planes[f, 2] * normals[i, 2]
            signs[f] = -1.0 if along < 0.0 else 1.0
    return signs


@numba.njit(cache=True)
def _mean_normals(planes: Floats, faces: Ints, count: int) -> Floats:
    """(count, 3) unit vectors: the mean of the normals (m, 3) of the faces (m, 3) at each of `count` vertices."""
    normals = np.zeros((count, 3))
    for f in range(len(faces)):
        for i in faces[f]:
            for axis in range(3):
                normals[i, axis] += planes[f, axis]
    return normals / np.maximum(np.sqrt((normals**2).sum(axis=1)), TINY).reshape(-1, 1)


@numba.njit(cache=True)
def surface_area(vertices: Floats, faces: Ints) -> float:
    """Area in mm² of faces (m, 3) over vertices (n, 3) mm, or (n, 2) in the plane, whatever their orientation."""
    if vertices.shape[1] == 2:
        return float(np.abs(signed_areas(vertices, faces)).sum())
    return float(0.5 * np.sqrt((face_normals(vertices, faces) ** 2).sum(axis=1)).sum())
