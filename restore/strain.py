"""How far the flat page had to be stretched."""

from __future__ import annotations

import numpy as np

from restore.scan import Floats, Ints


def edge_strain(flat: Floats, edges: Ints, lengths: Floats) -> Floats:
    """(e,) relative change of length of edges (e, 2) from lengths (e,) mm on the surface to flat (n, 2) mm."""
    return np.linalg.norm(flat[edges[:, 0]] - flat[edges[:, 1]], axis=1) / lengths - 1.0


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
