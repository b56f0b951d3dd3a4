"""Measures of a mesh and its flattening: lengths, areas, normals, strain."""

from __future__ import annotations

from math import acos

import numba
import numpy as np

from restore.mesh.adjacency import Sides
from restore.numerics.limits import TINY, overflows_silently, sum_in_order
from restore.scan import Floats, Ints

MIN_HEIGHT_RATIO = 1e-4  # of the base: least height of a face; the weights of a thinner one would have no bound


@overflows_silently
def straight_lengths(vertices: Floats, edges: Ints) -> Floats:
    """Return the straight distances (e,) mm between the ends of edges.

    vertices: (n, 3), or flat positions (n, 2), mm.
    edges: (e, 2).
    """
    apart = vertices.take(edges[:, 0], axis=0) - vertices.take(edges[:, 1], axis=0)
    return norms(apart)


@overflows_silently
def norms(vectors: Floats) -> Floats:
    """Return the lengths (k,) of vectors (k, 2) or (k, 3).

    The squares are added axis by axis, in single precision as well.
    """
    squares = np.square(vectors).astype(np.float64, copy=False)
    total = squares[:, 0] + squares[:, 1]
    for axis in range(2, squares.shape[1]):
        total += squares[:, axis]
    return np.sqrt(total)


def edge_strain(flat: Floats, edges: Ints, lengths: Floats) -> Floats:
    """Return the relative change of length of edges on the page.

    flat: (n, 2) mm.
    edges: (e, 2), of lengths (e,) mm on the surface.
    Returns (e,).
    """
    return np.asarray(straight_lengths(flat, edges) / lengths - 1.0)


def face_shapes(
    faces: Ints, edges: Ints, lengths: Floats, min_height_ratio: float = MIN_HEIGHT_RATIO
) -> tuple[Floats, Floats, Floats]:
    """Return the corners of each face in its plane.

    They are (0, 0), (base, 0) and (along, height). No height is less than min_height_ratio × base: over a crease three
    lengths may violate the triangle inequality.
    Returns base, along and height, (m,) mm each.
    """
    base, near, far = (lengths_between(faces[:, a], faces[:, b], edges, lengths) for a, b in ((0, 1), (0, 2), (1, 2)))
    along = (base**2 + near**2 - far**2) / (2.0 * base)
    return base, along, np.sqrt(np.maximum(near**2 - along**2, (min_height_ratio * base) ** 2))


def lengths_between(a: Ints, b: Ints, edges: Ints, lengths: Floats) -> Floats:
    """Return the lengths (k,) of the edges between vertices a and b, (k,).

    edges: (e, 2), in ascending order.
    """
    count = edges.max() + 1
    keys = edges[:, 0] * count + edges[:, 1]
    found: Floats = lengths[np.searchsorted(keys, np.minimum(a, b) * count + np.maximum(a, b))]
    return found


def corner_angles(faces: Ints, sides: Sides, lengths: Floats) -> Floats:
    """Return the corner angles of faces by the lengths of their sides.

    lengths: (e,). Returns (3·m,) rad, row by row; 0 for all corners of a face that names a vertex twice.
    """
    angles = np.zeros(3 * len(faces))
    _set_angles(sides.edge, np.ascontiguousarray(lengths), angles)
    return angles


@numba.njit(cache=True)
def _set_angles(edge: Ints, lengths: Floats, angles: Floats) -> None:
    """Write the angles (3·m,) of corners from the lengths of their edges.

    edge: (3·m,), or −1.
    lengths: (e,).
    """
    for first in range(0, len(angles), 3):
        if edge[first] < 0 or edge[first + 1] < 0 or edge[first + 2] < 0:
            continue
        for corner in range(3):
            a, b = lengths[edge[first + corner]], lengths[edge[first + (corner + 2) % 3]]
            c = lengths[edge[first + (corner + 1) % 3]]
            cosine = (a * a + b * b - c * c) / (2.0 * a * b + TINY)
            angles[first + corner] = acos(min(max(cosine, -1.0), 1.0))


@overflows_silently
def signed_areas(flat: Floats, faces: Ints) -> Floats:
    """Return the signed face areas (m,) mm², negative where flipped.

    flat: (n, 2).
    faces: (m, 3).
    """
    first, second, third = np.ascontiguousarray(faces.T)
    x, y = np.ascontiguousarray(flat.T)
    x_first, y_first = x.take(first), y.take(first)
    areas = (x.take(second) - x_first) * (y.take(third) - y_first)
    areas -= (y.take(second) - y_first) * (x.take(third) - x_first)
    return np.asarray(0.5 * areas, np.float64)


@overflows_silently
def flipped_faces(flat: Floats, faces: Ints) -> int:
    """Count the inverted faces: those of the orientation with less area.

    flat: (n, 2).
    faces: (m, 3). A face without area is not inverted.
    """
    areas = signed_areas(flat, faces)
    return int((areas < 0.0).sum() if areas.sum() >= 0.0 else (areas > 0.0).sum())


@overflows_silently
def face_normals(vertices: Floats, faces: Ints) -> Floats:
    """Return face normals (m, 3), twice as long as the areas.

    vertices: (n, 3) mm.
    faces: (m, 3).
    """
    first, second, third = (vertices.take(faces[:, corner], axis=0) for corner in range(3))
    return np.cross(second - first, third - first)


def vertex_normals(vertices: Floats, faces: Ints) -> Floats:
    """Return unit vertex normals (n, 3), the area-weighted mean of faces.

    faces: (m, 3).
    """
    return _mean_normals(face_normals(vertices, faces), faces, len(vertices))


@overflows_silently
def face_signs(vertices: Floats, faces: Ints, known: Floats | None = None) -> Floats:
    """Return −1 for faces that are folded over in space, else 1.

    Decimators leave such faces: they run against their corners' normals. The normal of a corner is the mean of its
    faces, weighted by area and by known signs; or by area alone, and then once more with the signs that are found.
    vertices: (n, 3).
    faces: (m, 3).
    known: (m,), small where a sign is uncertain.
    Returns (m,).
    """
    planes, signs = face_normals(vertices, faces), np.ones(len(faces)) if known is None else known
    for _ in range(2 if known is None else 1):
        normals, along = _mean_normals(planes * signs[:, None], faces, len(vertices)), np.zeros(len(faces))
        for corner in range(3):
            x, y, z = (planes * normals.take(faces[:, corner], axis=0)).T
            along += x + y + z
        signs = np.where(along < 0.0, -1.0, 1.0)
    return signs


@overflows_silently
def _mean_normals(planes: Floats, faces: Ints, count: int) -> Floats:
    """Return the mean face normals at `count` vertices, unit vectors.

    planes: (m, 3), normals of the faces (m, 3). Returns (count, 3).
    """
    corners = faces.ravel()
    normals: Floats = np.stack([np.bincount(corners, np.repeat(plane, 3), count) for plane in planes.T], axis=1)
    return normals / np.maximum(norms(normals), TINY)[:, None]


def surface_area(vertices: Floats, faces: Ints) -> float:
    """Return the area of faces in mm², whatever their orientation.

    vertices: (n, 3) mm, or (n, 2) in the plane.
    faces: (m, 3).
    """
    if vertices.shape[1] == 2:
        return sum_in_order(np.abs(signed_areas(vertices, faces)))
    return 0.5 * sum_in_order(norms(face_normals(vertices, faces)))
