"""How far the flat page had to be stretched."""

from __future__ import annotations

import numpy as np

from restore.scan import Floats, Ints

THINNEST = 1e-4  # height of a face as a share of its base; thinner ones, or none at all, would weigh without bound
THINNEST_STRAINED = 0.05  # and tell nothing of how the page was strained across them


def edge_strain(flat: Floats, edges: Ints, lengths: Floats) -> Floats:
    """(e,) relative change of length of edges (e, 2) from lengths (e,) mm on the surface to flat (n, 2) mm."""
    return np.linalg.norm(flat[edges[:, 0]] - flat[edges[:, 1]], axis=1) / lengths - 1.0


def face_strain(flat: Floats, faces: Ints, edges: Ints, lengths: Floats) -> Floats:
    """(m, 2) stretch and shear of every face from its shape on the surface to its flat one.

    edges (e, 2) in ascending order and lengths (e,) mm tell the shape on the surface. With σ₁ ≥ σ₂ the principal
    stretches, stretch is √(σ₁ σ₂) − 1, shear (σ₁ − σ₂) / 2.
    """
    base, along, height = face_shapes(faces, edges, lengths, THINNEST_STRAINED)
    first, second = (flat[faces[:, k]] - flat[faces[:, 0]] for k in (1, 2))
    right = first / base[:, None]
    up = (second - along[:, None] * right) / height[:, None]
    # The map from the surface to the page has the columns right and up.
    total = np.hypot(right[:, 0] + up[:, 1], right[:, 1] - up[:, 0])
    difference = np.hypot(right[:, 0] - up[:, 1], right[:, 1] + up[:, 0])
    stretch = np.sqrt(np.abs(total**2 - difference**2)) / 2.0 - 1.0
    return np.stack([stretch, difference / 2.0], axis=1)


def face_shapes(faces: Ints, edges: Ints, lengths: Floats, thinnest: float = THINNEST) -> tuple[Floats, Floats, Floats]:
    """Every face laid flat by itself: its corners are (0, 0), (base, 0) and (along, height); each (m,) mm.

    None is lower than thinnest × base: over a crease three lengths may make no triangle.
    """
    base, near, far = (between(faces[:, a], faces[:, b], edges, lengths) for a, b in ((0, 1), (0, 2), (1, 2)))
    along = (base**2 + near**2 - far**2) / (2.0 * base)
    return base, along, np.sqrt(np.maximum(near**2 - along**2, (thinnest * base) ** 2))


def at_vertices(values: Floats, faces: Ints, count: int) -> Floats:
    """(count, k) mean of the values (m, k) of the faces round each of `count` vertices, 0 where there is none."""
    total = np.zeros((count, values.shape[1]))
    np.add.at(total, faces.ravel(), np.repeat(values, 3, axis=0))
    return total / np.maximum(np.bincount(faces.ravel(), minlength=count), 1)[:, None]


def between(a: Ints, b: Ints, edges: Ints, lengths: Floats) -> Floats:
    """(k,) the lengths of the edges that join vertices a (k,) and b (k,); edges (e, 2) in ascending order."""
    count = edges.max() + 1
    keys = edges[:, 0] * count + edges[:, 1]
    found: Floats = lengths[np.searchsorted(keys, np.minimum(a, b) * count + np.maximum(a, b))]
    return found


def signed_areas(flat: Floats, faces: Ints) -> Floats:
    """(m,) mm², negative where a face is flipped."""
    a, b, c = (flat[faces[:, k]] for k in range(3))
    doubled: Floats = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    return doubled / 2.0


def flipped_faces(flat: Floats, faces: Ints) -> int:
    """How many faces lie with the wrong side up; the side of most of the area is the right one.

    A face without area has no side.
    """
    areas = signed_areas(flat, faces)
    return int((areas * (np.sign(areas.sum()) or 1.0) < 0).sum())


def surface_area(vertices: Floats, faces: Ints) -> float:
    """Area in mm² of faces (m, 3) over vertices (n, 3) mm."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0)
