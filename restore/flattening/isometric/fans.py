"""Signed angle fans: the directions of all edges round a vertex, from the edge lengths alone.

The faces round a vertex are laid out one after the other, each by the angle that its lengths give. A face that is
folded over in space counts backwards. Where the fan closes, its angles are scaled to 2π, unless their sum is
less than π: round a vertex that lies outside its neighbours they add up to 0. A vertex at which faces meet that share
no edge there (a non-manifold vertex) has several fans, each with a frame of its own.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numba
import numpy as np

from restore.mesh.adjacency import Sides
from restore.mesh.measures import corner_angles
from restore.scan import Floats, Ints


class Fans(NamedTuple):
    """owner (k,): the vertex of each fan. For every joint, an edge seen from a face at either of its ends:

    ends (j, 2): its vertices; fans (j, 2): the fans there; angles (j, 2) rad: its direction outward in their frames;
    edge (j,): which edge it is. An inner edge is one joint. One of three faces, whose fans are others at each of them,
    is five: one for each face, and one from each to the next.
    """

    owner: Ints
    ends: Ints
    fans: Ints
    angles: Floats
    edge: Ints


@numba.njit(cache=True)
def angle_fans(faces: Ints, sides: Sides, lengths: Floats, signs: Floats) -> Fans:
    """The fans of the vertices of faces (m, 3), all wound the same way round, and edges of lengths (e,) mm."""
    opposite = _opposite(faces, sides)
    owner, fan, start, end = _laid_out(faces, opposite, np.repeat(signs, 3) * corner_angles(faces, sides, lengths))
    fans, angles = np.empty((2 * len(opposite), 2), np.int64), np.empty((2 * len(opposite), 2))
    edge, found = np.empty(2 * len(opposite), np.int64), 0
    for e in range(len(sides.edges)):
        first = sides.first[e]
        for q in range(first, sides.first[e + 1]):
            if q > first and opposite[sides.at[q]] >= 0:
                continue
            for other in range(max(first, q - 1), q + 1):
                for k, side in ((0, sides.at[q]), (1, sides.at[other])):
                    leaves = faces[side // 3, side % 3] == sides.edges[e, k]
                    corner = side if leaves else side - side % 3 + (side + 1) % 3
                    fans[found, k], angles[found, k] = fan[corner], start[corner] if leaves else end[corner]
                edge[found], found = e, found + 1
    return Fans(owner, sides.edges[edge[:found]], fans[:found].copy(), angles[:found].copy(), edge[:found].copy())


@numba.njit(cache=True)
def _opposite(faces: Ints, sides: Sides) -> Ints:
    """(3·m,) the side that runs back along each, −1 where there is none or more than one."""
    opposite = np.full(3 * len(faces), -1)
    for e in range(len(sides.edges)):
        if sides.first[e + 1] - sides.first[e] != 2:
            continue
        one, other = sides.at[sides.first[e]], sides.at[sides.first[e] + 1]
        if faces[one // 3, one % 3] != faces[other // 3, other % 3]:
            opposite[one], opposite[other] = other, one
    return opposite


@numba.njit(cache=True)
def _laid_out(faces: Ints, opposite: Ints, angles: Floats) -> tuple[Ints, Ints, Floats, Floats]:
    """The vertex of every fan (k,), the fan of every corner (3·m,), and the directions of its two sides (3·m,) rad."""
    fan, owner, found = np.full(len(opposite), -1), np.empty(len(opposite), np.int64), 0
    start, end = np.zeros(len(opposite)), np.zeros(len(opposite))
    for bordered in (True, False):  # open fans from their first face on, then what is left: closed ones
        for corner in range(len(opposite)):
            if fan[corner] >= 0 or (bordered and opposite[corner] >= 0):
                continue
            total, at, closed = 0.0, corner, False
            while at >= 0 and fan[at] < 0:
                fan[at] = found
                total += angles[at]
                at = opposite[at - at % 3 + (at + 2) % 3]
            closed = not bordered and at == corner
            scale, turned, at = 2.0 * pi / total if closed and total > pi else 1.0, 0.0, corner
            while at >= 0 and fan[at] == found:
                start[at] = turned
                turned += scale * angles[at]
                end[at] = turned
                at = opposite[at - at % 3 + (at + 2) % 3]
                if at == corner:
                    break
            owner[found] = faces[corner // 3, corner % 3]
            found += 1
    return owner[:found].copy(), fan, start, end
