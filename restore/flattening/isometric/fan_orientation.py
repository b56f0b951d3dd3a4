"""Signs of the faces that are folded over, from the edge lengths.

The signed angles round an inner vertex add up to 2π, or to 0 where it is outside its neighbours. Where they do not, the
normals are misleading. Few signs make them do so, most often one set and its reverse: the fan of the vertex then
determines which of its faces have the same orientation, and fans that have a face in common determine it for all of
theirs.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import floor, frexp, pi

import numba
import numpy as np

from restore.mesh.adjacency import Sides, adjacency, inner_vertices
from restore.mesh.measures import corner_angles, face_signs
from restore.mesh.network import Network
from restore.numerics.limits import SINGLE_TINY, SMALL
from restore.numerics.robust import MAD_TO_SIGMA, SIGNIFICANT
from restore.scan import Floats, Ints

MAX_WAYS = 2048  # to close a fan of twelve faces, which are all tried; larger fans follow from their neighbours
BY_CHANCE = 0.5  # probability that a fan closes by chance; above it, that it closes proves nothing


def closing_signs(positions: Floats, network: Network, signs: Floats) -> Iterator[Floats]:
    """Yield face signs with which the fans of inner vertices close.

    The likeliest come first: the largest group of faces whose fans determine each other is reversed, and by the normals
    other groups and single faces; then most faces of each group are upright; then all, if noise has misled.
    positions: (n, 3) mm.
    signs: (m,), by the normals.
    Yields (m,).
    """
    ways, group = orient_by_fans(network.faces, network.sides, network.lengths, signs)
    largest = group == np.bincount(group).argmax()
    known = np.where(largest, _turned(ways, group, signs), SMALL * signs)  # where it is not near, as they were
    yield known if largest.all() else _turned(ways, group, face_signs(positions, network.faces, known))
    yield _turned(ways, group, np.ones(len(signs)))
    yield np.ones(len(signs))


def _turned(ways: Floats, group: Ints, signs: Floats) -> Floats:
    """Return the orientations within groups, each to agree with most signs.

    ways, group, signs: (m,); a whole group is reversed where most of its signs differ. Returns (m,) ±1.
    """
    return np.asarray(np.where(np.bincount(group, ways * signs)[group] < 0.0, -ways, ways))


def orient_by_fans(faces: Ints, sides: Sides, lengths: Floats, signs: Floats) -> tuple[Floats, Ints]:
    """Orient faces consistently where vertex fans allow one solution.

    Returns signs (m,), ±1 within a group, and group numbers (m,). Where the fans determine nothing, one group with the
    given signs (m,).
    """
    angles, corners = corner_angles(faces, sides, lengths), faces.ravel()
    inner = inner_vertices(sides, int(faces.max()) + 1)
    upright = inner.copy()
    upright[faces[~(signs > 0.0)]] = False
    if not upright.any():
        return signs, np.zeros(len(faces), np.int64)
    turns: Floats = np.asarray(np.bincount(corners, np.repeat(signs, 3) * angles, len(inner)), np.float64)
    gaps = _gaps(turns)
    # rad, up to which a gap is closed
    chance = float(SIGNIFICANT * MAD_TO_SIGMA * np.median(gaps[upright]) + SINGLE_TINY)
    known = upright & (gaps <= chance)
    fans = np.flatnonzero(inner & ~known)
    open_fans = int((gaps[fans] > chance).sum())
    ways = min(BY_CHANCE * pi / (chance * max(open_fans, 1)), MAX_WAYS)  # of more some would close by chance
    if open_fans == 0 or ways < 4.0:  # those of the smallest fan, of three faces
        return signs, np.zeros(len(faces), np.int64)
    # An angle that is no more than chance says nothing of its face.
    is_sure = 2.0 * angles > chance
    around = adjacency(corners[is_sure], np.flatnonzero(is_sure), len(inner))
    parent, turn = np.arange(len(faces)), np.ones(len(faces))
    # A fan of k faces closes in 2^(k − 1) ways: the last face stays, as the reverse is the same way.
    most = frexp(ways)[1]
    scratch = np.empty((2, max(most, np.diff(around.start).max(initial=0))))
    _write_groups(np.flatnonzero(known), fans, *around, angles, signs, chance, most, parent, turn, *scratch)
    return turn, parent


def _gaps(angles: Floats) -> Floats:
    """How far angles (n,) are from the nearest multiple of 2π."""
    return np.abs(angles - 2.0 * pi * np.floor(angles / (2.0 * pi) + 0.5))


@numba.njit(cache=True)
def _write_groups(
    known: Ints, fans: Ints, start: Ints, corners: Ints, angles: Floats, signs: Floats, chance: float, most: int,
    parent: Ints, turn: Floats, chosen: Floats, found: Floats,
) -> None:  # fmt: skip
    """Write the group of each face and its orientation within the group.

    The fans of known vertices join their faces by their signs, then each of the other `fans`, of `most` faces at most,
    does that closes in one way. The corners (c,) of vertex i are those from start[i] on.
    parent: (m,), the face that stands for the group of each.
    turn: (m,), orientation relative to that face, ±1.
    chosen, found: scratch.
    """
    for i in known:
        for q in range(start[i], start[i + 1]):
            found[q - start[i]] = signs[corners[q] // 3]
        _join(corners[start[i] : start[i + 1]], found, parent, turn)
    asked, left = -1, len(fans)
    while left != asked:  # one fan may leave its neighbour a single way to close
        asked, left = left, 0
        for k in range(asked):
            i = fans[k]
            own = corners[start[i] : start[i + 1]]
            if len(own) <= most and _ways(own, angles, chance, parent, turn, chosen, found) < 2:
                continue
            fans[left] = i
            left += 1
        for k in range(left // 2):
            fans[k], fans[left - 1 - k] = fans[left - 1 - k], fans[k]
    for face in range(len(parent)):
        _root(face, parent, turn)


@numba.njit(cache=True)
def _ways(
    own: Ints, angles: Floats, chance: float, parent: Ints, turn: Floats, chosen: Floats, found: Floats
) -> int:  # fmt: skip
    """Count the known-compatible ways in which a fan closes.

    own: (k,) corners of the fan. If one way is left, it joins their faces.
    """
    ways = 0
    for bits in range(1 << max(len(own) - 1, 0)):
        total = 0.0
        for q in range(len(own)):
            chosen[q] = -1.0 if bits >> q & 1 else 1.0
            total += chosen[q] * angles[own[q]]
        if abs(total - 2.0 * pi * floor(total / (2.0 * pi) + 0.5)) <= chance and _agree(own, chosen, parent, turn):
            ways += 1
            for q in range(len(own)):
                found[q] = chosen[q]
    if ways == 1:
        _join(own, found, parent, turn)
    return ways


@numba.njit(cache=True)
def _root(f: int, parent: Ints, turn: Floats) -> tuple[int, float]:
    """Return the root face of the group of f, and f's orientation, ±1.

    The orientation is relative to the root face.
    """
    root, way = f, 1.0
    while parent[root] != root:
        way *= turn[root]
        root = parent[root]
    parent[f], turn[f] = root, way  # the way is shorter the next time
    return root, way


@numba.njit(cache=True, inline="always")
def _agree(own: Ints, signs: Floats, parent: Ints, turn: Floats) -> bool:
    """Return whether signs (k,) of own corners (k,) contradict nothing known."""
    for q in range(len(own)):
        root, way = _root(own[q] // 3, parent, turn)
        for other in range(q):
            same, turned = _root(own[other] // 3, parent, turn)
            if same == root and signs[q] * way != signs[other] * turned:
                return False
    return True


@numba.njit(cache=True)
def _join(own: Ints, signs: Floats, parent: Ints, turn: Floats) -> None:
    """Join the faces of own corners (k,) into one group by signs (k,).

    In place; what is known already stays.
    """
    for q in range(1, len(own)):
        root, way = _root(own[0] // 3, parent, turn)
        same, turned = _root(own[q] // 3, parent, turn)
        if same != root:
            parent[same] = root
            turn[same] = signs[0] * way * signs[q] * turned
