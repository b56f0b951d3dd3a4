"""Split the cells of a fine mesh where the page is seen at a flat angle.

The picture is mapped linearly within a face. On a steep side a cell of the lattice covers many millimetres of the page,
and their scale changes within it: its edges are split at the middle of their lengths on the page until that does.
"""

from __future__ import annotations

import numpy as np

from restore.mesh.adjacency import sides_of
from restore.outline.sides import grid_jacobians, rebuild_page, solve_grid_positions
from restore.range_image.sheet import Sheet
from restore.scan import FlatMesh, Floats, Ints, Mask

NONLINEAR_MM = 0.02  # a quarter of a pixel at 300 dpi: less is not seen
ROUNDS = 3  # of splitting: a cell of four samples is half a sample wide then


def subdivide(sheet: Sheet, page: FlatMesh, nodes: Floats) -> tuple[FlatMesh, Floats]:
    """The page with split faces, and the grid positions (k, 2) of its vertices; the first are nodes (n, 2).

    An edge is split whose middle in the picture is more than NONLINEAR_MM from its middle on the page.
    """
    flat, faces, added = page.flat, page.faces, np.ones(len(nodes), bool)
    for _ in range(ROUNDS):
        sides = sides_of(faces)
        start, end = sides.edges.T
        among = np.flatnonzero(added[sides.edges].any(axis=1))  # the others were looked at before
        middles, off = _middles(sheet, nodes, sides.edges[among])
        middles, chosen = middles[off > NONLINEAR_MM], among[off > NONLINEAR_MM]
        if len(chosen) == 0:
            break
        split = np.isin(np.arange(len(sides.edges)), chosen)
        faces = _split_faces(faces, sides.edge.reshape(-1, 3), split, len(nodes))
        added = np.arange(len(nodes) + len(chosen)) >= len(nodes)
        flat = np.concatenate([flat, 0.5 * (flat[start] + flat[end])[chosen]])
        nodes = np.concatenate([nodes, middles])
        edges = sides_of(faces).edges
        edges = edges[added[edges].any(axis=1)]
        nodes = solve_grid_positions(sheet, nodes, added, grid_jacobians(flat, nodes, edges, added), flat, edges)
    return (page if faces is page.faces else rebuild_page(sheet, page, flat, nodes, faces)), nodes


def _middles(sheet: Sheet, nodes: Floats, edges: Ints) -> tuple[Floats, Floats]:
    """Grid positions (e, 2) about half of the length along edges (e, 2), and how far, mm, that is from their middles
    (e,) in the picture."""
    count = len(nodes)
    both = np.concatenate([nodes, nodes[edges].mean(axis=1)])
    first, second = (
        sheet.lengths(both, np.stack([edges[:, k], count + np.arange(len(edges))], axis=1)) for k in (0, 1)
    )
    share = first / (first + second)
    place = np.where(share > 0.5, 0.25 / share, 1.0 - 0.25 / (1.0 - share))[:, None]
    return nodes[edges[:, 0]] * (1.0 - place) + nodes[edges[:, 1]] * place, 0.5 * np.abs(first - second)


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
        order = (np.arange(3) + np.reshape(first, (-1, 1))) % 3
        a, b, c = np.take_along_axis(faces[chosen], np.broadcast_to(order, faces[chosen].shape), axis=1).T
        ab, bc, ca = np.take_along_axis(number[chosen], np.broadcast_to(order, faces[chosen].shape), axis=1).T
        corners = {
            1: ((a, ab, c), (ab, b, c)),
            2: ((ab, b, bc), (a, ab, bc), (a, bc, c)),
            3: ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)),
        }[many]
        parts += [np.stack(corner, axis=1) for corner in corners]
    return np.concatenate(parts)
