"""Signs of the faces that are folded over, from the lengths of their sides.

The signed angles round an inner vertex add up to 2π, or to 0 where it lies outside its neighbours. Where they do not,
the normals have misled. Few signs make them do so, most often in one way and its reverse: the fan of the vertex then
tells which of its faces lie the same way round, and fans that share a face tell it of all of theirs.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import floor, pi
from typing import NamedTuple

import numba
import numpy as np

from restore.mesh.adjacency import Adjacency, Sides, adjacency, inner_vertices
from restore.mesh.jets import SIGMAS
from restore.mesh.measures import corner_angles, face_signs
from restore.mesh.network import Network
from restore.numerics.limits import SINGLE_TINY, SMALL
from restore.numerics.robust import MAD_TO_SIGMA
from restore.scan import Floats, Ints

MOST_WAYS = 2048  # to close a fan of twelve faces, which are all tried; other fans tell of the faces of larger ones
BY_CHANCE = 0.5  # fans that close by chance in one of their ways: if more may, that one does is no evidence


class Corners(NamedTuple):
    """The angles (3·m,) rad at the corners of faces row by row, and those around each vertex.

    chance  rad, gaps up to which are closed.
    ways    how many ways of a fan are tried at most: of more some would close by chance.
    """

    angles: Floats
    around: Adjacency
    chance: float
    ways: float


class Groups(NamedTuple):
    """A forest of faces: each is known to lie the same way round as its parent (m,), turn (m,) 1, or the other, −1."""

    parent: Ints
    turn: Floats


def closing_signs(positions: Floats, network: Network, signs: Floats) -> Iterator[Floats]:
    """(m,) signs of faces over positions (n, 3) mm with which the fans of inner vertices close, the likeliest first.

    signs (m,) are those by the normals. They turn the largest group of faces whose fans tell of each other, the normals
    beside it other groups and single faces; then most faces of each group are upright; then all, if noise has misled.
    """
    ways, group = told_together(network.faces, network.sides, network.lengths, signs)
    largest = group == np.bincount(group).argmax()
    known = np.where(largest, _turned(ways, group, signs), SMALL * signs)  # where it is not near, as they were
    yield known if largest.all() else _turned(ways, group, face_signs(positions, network.faces, known))
    yield _turned(ways, group, np.ones(len(signs)))
    yield np.ones(len(signs))


def _turned(ways: Floats, group: Ints, signs: Floats) -> Floats:
    """(m,) the ways, 1 or −1, that faces lie within their groups (m,), each turned to agree with most signs (m,)."""
    return np.asarray(np.where(np.bincount(group, ways * signs)[group] < 0.0, -ways, ways))


@numba.njit(cache=True)
def told_together(faces: Ints, sides: Sides, lengths: Floats, signs: Floats) -> tuple[Floats, Ints]:
    """Which way round, 1 or −1, each face (m,) lies within its group (m,) of faces whose fans tell of each other.

    One group with the signs (m,) as they are where nothing can be told.
    """
    inner = inner_vertices(sides, faces.max() + 1)
    angles, gaps, upright = corner_angles(faces, sides, lengths), np.zeros(len(inner)), inner.copy()
    for corner, i in enumerate(faces.ravel()):
        gaps[i] += signs[corner // 3] * angles[corner]
        upright[i] &= signs[corner // 3] > 0.0
    if not upright.any():
        return signs, np.zeros(len(faces), np.int64)
    gaps = np.array([_gap(gap) for gap in gaps])
    chance = SIGMAS * MAD_TO_SIGMA * np.median(gaps[upright]) + SINGLE_TINY
    known = upright & (gaps <= chance)
    fans, asked = np.flatnonzero(inner & ~known), -1
    ways = min(BY_CHANCE * pi / (chance * max((gaps[fans] > chance).sum(), 1)), MOST_WAYS)
    if (gaps[fans] <= chance).all() or ways < 4.0:  # those of the smallest fan, of three faces
        return signs, np.zeros(len(faces), np.int64)
    corners = Corners(angles, adjacency(faces.ravel(), np.arange(len(angles)), len(inner)), chance, ways)
    groups = Groups(np.arange(len(faces)), np.ones(len(faces)))
    for i in np.flatnonzero(known):
        own, _ = _told(i, corners)
        _join(own, signs[own], groups)
    while len(fans) != asked:  # what one fan tells may leave its neighbour but one way to close
        asked = len(fans)
        fans = fans[np.array([not _settled(i, corners, groups) for i in fans], np.bool_)][::-1].copy()
    roots = [_root(f, groups) for f in range(len(faces))]
    return np.array([way for _, way in roots]), np.array([root for root, _ in roots])


@numba.njit(cache=True)
def _told(i: int, corners: Corners) -> tuple[Ints, Floats]:
    """The faces (k,) at vertex i whose signs its fan can tell, and their angles (k,) rad there: more than chance."""
    own = corners.around.items[corners.around.start[i] : corners.around.start[i + 1]]
    own = own[2.0 * corners.angles[own] > corners.chance]
    return own // 3, corners.angles[own]


@numba.njit(cache=True)
def _settled(i: int, corners: Corners, groups: Groups) -> bool:
    """Whether the fan of vertex i closes in one way that agrees with what is known, or in none.

    That one way joins its faces, in place.
    """
    own, angles = _told(i, corners)
    most = 1 << max(len(own) - 1, 0)  # the last face stays, as the reverse is the same way
    if most > corners.ways:
        return False
    ways, found = 0, np.ones(len(own))
    for chosen in range(most):
        total = 0.0
        for q in range(len(own)):
            total += -angles[q] if chosen >> q & 1 else angles[q]
        if _gap(total) <= corners.chance:
            signs = np.where(chosen >> np.arange(len(own)) & 1, -1.0, 1.0)
            if _agree(own, signs, groups):
                ways, found = ways + 1, signs
    if ways == 1:
        _join(own, found, groups)
    return ways < 2


@numba.njit(cache=True)
def _root(f: int, groups: Groups) -> tuple[int, float]:
    """The face that stands for the group of face f, and whether f lies the same way round, 1, or not, −1."""
    root, turn = f, 1.0
    while groups.parent[root] != root:
        turn *= groups.turn[root]
        root = groups.parent[root]
    groups.parent[f], groups.turn[f] = root, turn  # the way is shorter the next time
    return root, turn


@numba.njit(cache=True)
def _agree(own: Ints, signs: Floats, groups: Groups) -> bool:
    """Whether signs (k,) of own faces (k,) contradict nothing that is known."""
    for q in range(len(own)):
        root, turn = _root(own[q], groups)
        for other in range(q):
            same, way = _root(own[other], groups)
            if same == root and signs[q] * turn != signs[other] * way:
                return False
    return True


@numba.njit(cache=True)
def _join(own: Ints, signs: Floats, groups: Groups) -> None:
    """Make own faces (k,) one group, in place, by their signs (k,); what is known already stays."""
    for q in range(1, len(own)):
        root, turn = _root(own[0], groups)
        same, way = _root(own[q], groups)
        if same != root:
            groups.parent[same] = root
            groups.turn[same] = signs[0] * turn * signs[q] * way


@numba.njit(cache=True)
def _gap(angle: float) -> float:
    """How far an angle is from the nearest multiple of 2π."""
    return abs(angle - 2.0 * pi * floor(angle / (2.0 * pi) + 0.5))
