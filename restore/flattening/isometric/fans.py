"""Signed angle fans: edge directions round a vertex, from lengths alone.

The faces round a vertex are unfolded one after the other, each by the angle that its lengths give. A face that is
folded over in space counts backwards. Where the fan closes, its angles are scaled to 2π, unless their sum is less than
π: round a vertex outside its neighbours they add up to 0. A vertex at which faces meet without a common edge there (a
non-manifold vertex) has several fans, each with a separate frame.
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
    """Fans of vertices and the joints between them.

    A joint is an edge seen from a face at either of its ends. An inner edge is one joint. One of three faces, whose
    fans are others at each of them, is five: one for each face, and one from each to the next.
    owner: (k,), the vertex of each fan.
    ends: (j, 2), vertices of each joint.
    fans: (j, 2), the fans there.
    angles: (j, 2) rad, its direction outward in their frames.
    edge: (j,), its edge.
    """

    owner: Ints
    ends: Ints
    fans: Ints
    angles: Floats
    edge: Ints


def angle_fans(faces: Ints, sides: Sides, lengths: Floats, signs: Floats) -> Fans:
    """Return the fans of the vertices of consistently oriented faces.

    faces: (m, 3).
    lengths: (e,) mm, of the edges.
    """
    opposite, angles = _opposite(faces, sides), np.repeat(signs, 3) * corner_angles(faces, sides, lengths)
    fan, first, start, end = (
        np.full(faces.size, -1),
        np.empty_like(opposite),
        np.zeros(faces.size),
        np.zeros(faces.size),
    )
    count = _unfold_fans(opposite, angles, fan, first, start, end)
    edge, one, other = _joints(sides, opposite)
    ends, begins = sides.edges[edge], faces.ravel()
    fans, directions = np.empty_like(ends), np.empty(ends.shape)
    for k, side in ((0, one), (1, other)):
        leaves = begins[side] == ends[:, k]
        corner = np.where(leaves, side, side - side % 3 + (side + 1) % 3)
        fans[:, k], directions[:, k] = fan[corner], np.where(leaves, start[corner], end[corner])
    return Fans(begins[first[:count]], ends, fans, directions, edge)


def _joints(sides: Sides, opposite: Ints) -> tuple[Ints, Ints, Ints]:
    """Return the edge of each joint and the sides from which it is seen.

    All three are (j,), in the order of `Fans`.
    """
    begins = np.zeros(len(sides.at), bool)
    begins[sides.first[:-1]] = True
    place = np.flatnonzero(begins | (opposite[sides.at] < 0))
    two = ~begins[place]  # to the side before it and by itself
    place = np.repeat(place, np.where(two, 2, 1))
    before = place.copy()
    before[np.flatnonzero(two) + np.arange(two.sum())] -= 1
    one = sides.at[place]
    return sides.edge[one], one, sides.at[before]


def _opposite(faces: Ints, sides: Sides) -> Ints:
    """Return the side that runs back along each side, (3·m,), −1 where it is not exactly one."""
    opposite, begins = np.full(faces.size, -1), faces.ravel()
    shared = sides.first[:-1][np.diff(sides.first) == 2]
    one, other = sides.at[shared], sides.at[shared + 1]
    back = begins[one] != begins[other]
    opposite[one[back]], opposite[other[back]] = other[back], one[back]
    return opposite


@numba.njit(cache=True)
def _unfold_fans(opposite: Ints, angles: Floats, fan: Ints, first: Ints, start: Floats, end: Floats) -> int:
    """Write the fan of every corner and the directions of its two sides.

    fan, start, end: (3·m,), the directions in rad in the corner's fan. Returns the number of fans, whose first corners
        are written to first.
    """
    found = 0
    for bordered in (True, False):  # open fans from their first face on, then what is left: closed ones
        for corner in range(len(opposite)):
            if fan[corner] >= 0 or (bordered and opposite[corner] >= 0):
                continue
            total, at = 0.0, corner
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
            first[found] = corner
            found += 1
    return found
