"""Convex polygons on the page, as creases cut it, and meshes of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from drivers.simulated.scene.sheets.sheet import PageSize
from restore.scan import Floats, Ints

WELD_MM = 1e-6  # corners of neighbouring facets closer than this are one vertex; far below a micron, far above rounding


def split(polygon: Floats, side: Floats) -> tuple[Floats, Floats]:
    """Split a convex polygon where `side` (k,), linear over it, is 0.

    Returns the parts (k, 2) where it is negative and positive; or empty.
    """
    below: list[Floats] = []
    above: list[Floats] = []
    for start, end, here, there in zip(polygon, np.roll(polygon, -1, 0), side, np.roll(side, -1), strict=True):
        if here <= 0:
            below.append(start)
        if here >= 0:
            above.append(start)
        if here * there < 0:
            crossing = start + (end - start) * (here / (here - there))
            below.append(crossing)
            above.append(crossing)
    return _polygon(below), _polygon(above)


def _polygon(points: list[Floats]) -> Floats:
    return np.array(points) if len(points) > 2 else np.empty((0, 2))


def clip(polygon: Floats, page_mm: PageSize) -> Floats:
    """Return the part (k, 2) of a convex polygon on the page; empty outside the page."""
    for axis in (0, 1):
        for sign in (1.0, -1.0):
            if len(polygon):
                polygon, _ = split(polygon, sign * polygon[:, axis] - page_mm[axis] / 2)
    return polygon


def mesh_of_polygons(polygons: Iterable[Floats]) -> tuple[Floats, Ints]:
    """Return one mesh (n, 2), (m, 3) of convex polygons.

    They are counter-clockwise; common corners become one vertex.
    """
    fans = [np.stack([np.broadcast_to(p[0], p[1:-1].shape), p[1:-1], p[2:]], axis=1) for p in polygons if len(p) > 2]
    triangles = np.concatenate(fans)
    # What cutting at a corner leaves behind is not a facet.
    triangles = triangles[doubled_areas(triangles) > WELD_MM]
    keys = np.round(triangles.reshape(-1, 2) / WELD_MM).astype(np.int64)
    _, first, vertex = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return triangles.reshape(-1, 2)[first], vertex.reshape(-1, 3)


def doubled_areas(triangles: Floats) -> Floats:
    """Return twice the signed areas (m,) mm² of triangles (m, 3, 2)."""
    edge, other = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return np.asarray(edge[:, 0] * other[:, 1] - edge[:, 1] * other[:, 0])


def level(normals: Floats, areas: Floats) -> Floats:
    """Return the rotation (3, 3) that levels the mean of normals (n, 3).

    Weighted by areas (n,); it is turned towards the reader (+z).
    """
    mean = (normals * areas[:, None]).sum(axis=0)
    z = mean / np.linalg.norm(mean)
    x = np.array([z[2], 0.0, -z[0]]) / np.hypot(z[0], z[2])
    return np.stack([x, np.cross(z, x), z])


def areas_of(polygons: Sequence[Floats]) -> Floats:
    """Return the areas (n,) mm² of counter-clockwise polygons."""
    return np.array([np.sum(p[:, 0] * np.roll(p[:, 1], -1) - np.roll(p[:, 0], -1) * p[:, 1]) / 2 for p in polygons])
