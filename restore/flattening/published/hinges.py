"""Hinges: pairs of faces that unfold into one plane round their edge."""

from __future__ import annotations

from math import sqrt

import numba
import numpy as np

from restore.mesh.adjacency import Sides
from restore.mesh.network import Network
from restore.scan import Floats, Ints


def hinges_of(network: Network, bending: bool = True) -> tuple[Ints, Floats]:
    """Return the corners opposite over every inner edge, and their spans.

    A span is their distance when both triangles are unfolded into one plane, from five lengths. Keeping them there is
    the bending resistance of a sheet; without bending both are empty.
    Returns corners (b, 2) and spans (b,) mm.
    """
    corners, spans = _hinges_of(network.faces, network.sides, network.lengths)
    return (corners, spans) if bending else (corners[:0], spans[:0])


@numba.njit(cache=True)
def _hinges_of(faces: Ints, sides: Sides, lengths: Floats) -> tuple[Ints, Floats]:
    hinges, spans, found = np.empty((len(lengths), 2), np.int64), np.empty(len(lengths)), 0
    for e in range(len(lengths)):
        pair = sides.first[e]
        if sides.first[e + 1] - pair != 2:  # an edge of three faces is a flaw of the mesh and no hinge
            continue
        hinges[found, 0], x0, y0 = _corner(sides.at[pair], faces, sides, lengths)
        hinges[found, 1], x1, y1 = _corner(sides.at[pair + 1], faces, sides, lengths)
        spans[found] = sqrt((x0 - x1) ** 2 + (y0 + y1) ** 2)
        found += 1
    return hinges[:found].copy(), spans[:found].copy()


@numba.njit(cache=True)
def _corner(side: int, faces: Ints, sides: Sides, lengths: Floats) -> tuple[int, float, float]:
    """Return the corner opposite a side, and its position.

    The position is along the edge, from its smaller vertex, and above it.
    """
    face, k = side // 3, side % 3
    following, last = lengths[sides.edge[3 * face + (k + 1) % 3]], lengths[sides.edge[3 * face + (k + 2) % 3]]
    near, far = (last, following) if faces[face, k] < faces[face, (k + 1) % 3] else (following, last)
    base = lengths[sides.edge[side]]
    # Never farther along than the side is long, or a sliver would throw its corner off the page.
    along = min(max((near**2 - far**2 + base**2) / (2.0 * base), -near), near)
    return faces[face, (k + 2) % 3], along, sqrt(max(near**2 - along**2, 0.0))
