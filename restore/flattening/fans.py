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
from restore.numerics import SMALL
from restore.scan import Floats, Ints, Mask

EVIDENCE = 0.5  # of what a sign that is wrong alone would close


class Fans(NamedTuple):
    """owner (k,): the vertex of each fan. For every joint, an edge seen from the same face at both of its ends:

    ends (j, 2): its vertices; fans (j, 2): the fans there; angles (j, 2) rad: its direction outward in their frames;
    edge (j,): which edge it is. An inner edge is one joint, an edge of three faces three of them.
    """

    owner: Ints
    ends: Ints
    fans: Ints
    angles: Floats
    edge: Ints


@numba.njit(cache=True)
def closing_signs(faces: Ints, sides: Sides, lengths: Floats, signs: Floats) -> Floats:
    """(m,) the signs of faces with which the fans of inner vertices close best: to 2π, or 0 outside their neighbours.

    They are looked for from the signs by the normals, and where those are contradicted from a sheet without folds too.
    """
    angles, inner = corner_angles(faces, sides, lengths), np.ones(faces.max() + 1, np.bool_)
    pairs, found = np.full((len(faces) + len(sides.edges), 2), -1), len(faces)
    pairs[:found, 0] = np.arange(found)
    for e in range(len(sides.edges)):
        if sides.first[e + 1] - sides.first[e] == 2:
            pairs[found], found = sides.at[sides.first[e] : sides.first[e + 1]] // 3, found + 1
        else:
            inner[sides.edges[e, 0]] = inner[sides.edges[e, 1]] = False
    by_normals, upright = signs.copy(), np.ones(len(signs))
    open_by = _close(by_normals, faces, angles, inner, pairs[:found])
    if (by_normals == signs).all() or open_by <= _close(upright, faces, angles, inner, pairs[:found]):
        return by_normals
    return upright


@numba.njit(cache=True)
def _close(signs: Floats, faces: Ints, angles: Floats, inner: Mask, pairs: Ints) -> float:
    """By how much, rad, the fans of all inner vertices (n,) stay open when signs (m,) are turned, in place.

    Those of one face, or of a pair that shares an edge, are turned where that closes the fans at their corners by at
    least half as much as it would if no other were wrong; the other half speaks for the signs as they were.
    """
    gaps = np.zeros(len(inner))
    for corner in range(len(angles)):
        gaps[faces[corner // 3, corner % 3]] += signs[corner // 3] * angles[corner]
    after, turned = gaps.copy(), 1
    while turned:  # a sign that is turned may free those of its neighbours; each closes the fans further
        turned = 0
        for pair in pairs:
            turned += _turned(pair, faces, angles, inner, signs, gaps, after)
    total = 0.0
    for i in range(len(gaps)):
        total += _gap(gaps[i]) if inner[i] else 0.0
    return total


@numba.njit(cache=True)
def _turned(pair: Ints, faces: Ints, angles: Floats, inner: Mask, signs: Floats, gaps: Floats, after: Floats) -> bool:
    """Turn the signs (m,) of a pair of faces, −1 where it has but one, if that closes the fans; whether it did.

    gaps (n,) are the sums of signed angles round every vertex, after (n,) the same, to be written to and back.
    """
    count, first = 1 if pair[1] < 0 else 2, faces[pair[0]]
    for f in pair[:count]:
        for c in range(3):
            after[faces[f, c]] -= 2.0 * signs[f] * angles[3 * f + c]
    gain, most = 0.0, SMALL
    for k in range(3 * count):
        i = faces[pair[k // 3], k % 3]
        if inner[i] and (k < 3 or not (i == first[0] or i == first[1] or i == first[2])):
            gain += _gap(gaps[i]) - _gap(after[i])
            most += _gap(gaps[i] - after[i])
    turned = gain > EVIDENCE * most
    for f in pair[:count]:
        signs[f] = -signs[f] if turned else signs[f]
        for c in range(3):
            i = faces[f, c]
            gaps[i], after[i] = (after[i], after[i]) if turned else (gaps[i], gaps[i])
    return turned


@numba.njit(cache=True)
def _gap(angle: float) -> float:
    """How far an angle is from the nearest multiple of 2π."""
    return abs(angle - 2.0 * pi * round(angle / (2.0 * pi)))


@numba.njit(cache=True)
def angle_fans(faces: Ints, sides: Sides, lengths: Floats, signs: Floats) -> Fans:
    """The fans of the vertices of faces (m, 3), all wound the same way round, and edges of lengths (e,) mm."""
    opposite = _opposite(faces, sides)
    owner, fan, start, end = _laid_out(faces, opposite, np.repeat(signs, 3) * corner_angles(faces, sides, lengths))
    ends, fans = np.empty((len(opposite), 2), np.int64), np.empty((len(opposite), 2), np.int64)
    angles, edge, found = np.empty((len(opposite), 2)), np.empty(len(opposite), np.int64), 0
    for side in range(len(opposite)):
        if sides.edge[side] < 0 or (opposite[side] >= 0 and opposite[side] < side):
            continue
        following = side - side % 3 + (side + 1) % 3
        ends[found, 0], ends[found, 1] = faces[side // 3, side % 3], faces[side // 3, following % 3]
        fans[found, 0], fans[found, 1] = fan[side], fan[following]
        angles[found, 0], angles[found, 1] = start[side], end[following]
        edge[found] = sides.edge[side]
        found += 1
    return Fans(owner, ends[:found].copy(), fans[:found].copy(), angles[:found].copy(), edge[:found].copy())


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
