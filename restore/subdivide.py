"""Split the cells of a fine mesh where the page is seen at a flat angle.

The picture is mapped linearly within a face. On a steep side a cell of the lattice covers many millimetres of the page,
and their scale changes within it. There edges are split at their middles on the page. Where those lie in the picture
the normals at both ends tell, which noise turns far less than it moves points along a flat line of sight.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from restore.mesh.adjacency import sides_of
from restore.mesh.measures import straight_lengths
from restore.range_image.facets.sheet import PageOnGrid, Sheet
from restore.scan import Floats, Ints, Mask

NONLINEAR_MM = 0.02  # a quarter of a pixel at 300 dpi: less is not seen
MOST = 0.05  # of an edge: no surface that bends evenly moves the middle farther within a few samples; a crease does
ROUNDS = 2  # of splitting: the halves of a cell of four samples are as wide as one then


def subdivide(sheet: Sheet, page: PageOnGrid) -> PageOnGrid:
    """The page with split faces; its first vertices are those of the page.

    An edge is split where the middle of it in the picture would be shown more than NONLINEAR_MM off on the page.
    """
    (flat, faces, nodes), normals = page, sheet.normals()
    for _ in range(ROUNDS):
        sides = sides_of(faces)
        start, end = sides.edges.T
        middles = _middles(sheet, normals, nodes, sides.edges)
        apart = np.hypot(*(middles - 0.5 * (nodes[start] + nodes[end])).T)
        off = apart / straight_lengths(nodes, sides.edges)  # share of an edge
        split = (off * straight_lengths(flat, sides.edges) > NONLINEAR_MM) & (off < MOST)
        if not split.any():
            break
        faces = _split_faces(faces, sides.edge.reshape(-1, 3), split, len(nodes))
        flat = np.concatenate([flat, 0.5 * (flat[start[split]] + flat[end[split]])])
        nodes = np.concatenate([nodes, middles[split]])
    return PageOnGrid(flat, faces, nodes)


def _middles(sheet: Sheet, normals: NDArray[np.float32], nodes: Floats, edges: Ints) -> Floats:
    """(e, 2) grid positions of the middles of cubics (Hermite) over edges (e, 2), tangent to the facets at both ends.

    normals (rows, cols, 3) are those of the facets.
    """
    points = sheet.points(nodes)
    normal = np.stack([map_coordinates(normals[..., k], nodes.T, order=1, mode="nearest") for k in range(3)], axis=1)
    start, end = edges.T
    chord, rise, sink = points[end] - points[start], normal[start], normal[end]
    falls, rises = (np.einsum("ij,ij->i", one, chord)[:, None] for one in (sink, rise))
    bulge = sink * falls - rise * rises
    middle = 0.5 * (points[start] + points[end]) + bulge / 8.0
    return np.stack(sheet.rays.grid(middle), axis=1)


def _split_faces(faces: Ints, edge: Ints, split: Mask, count: int) -> Ints:
    """Faces (k, 3) from faces (m, 3) whose sides are edges (m, 3), those split (e,) at new vertices from count on.

    Side k of a face runs from corner k to the next. The new vertices have the order of the split edges.
    """
    number = np.where(split, count - 1 + np.cumsum(split), -1)[edge]
    broken = split[edge]
    parts = [faces[~broken.any(axis=1)]]
    for many in (1, 2, 3):
        chosen = broken.sum(axis=1) == many
        # Turned so that the first sides are the split ones, one after the other.
        first = np.argmax(broken[chosen] & ~np.roll(broken[chosen], 1, axis=1), axis=1) if many < 3 else 0
        order = np.broadcast_to((np.arange(3) + np.reshape(first, (-1, 1))) % 3, faces[chosen].shape)
        a, b, c = np.take_along_axis(faces[chosen], order, axis=1).T
        ab, bc, ca = np.take_along_axis(number[chosen], order, axis=1).T
        corners = {
            1: ((a, ab, c), (ab, b, c)),
            2: ((ab, b, bc), (a, ab, bc), (a, bc, c)),
            3: ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)),
        }[many]
        parts += [np.stack(corner, axis=1) for corner in corners]
    return np.concatenate(parts)
