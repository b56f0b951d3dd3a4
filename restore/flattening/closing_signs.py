"""Signs of the faces that are folded over, from the lengths of their sides alone.

The signed angles round an inner vertex add up to 2π, or to 0 where it lies outside its neighbours. Where they do not,
the normals have misled. Few signs make them do so, most often in one way and its reverse: the fan of the vertex then
tells which of its faces lie the same way round, and fans that share a face tell it of all of theirs.
"""

from __future__ import annotations

from math import floor, pi
from typing import NamedTuple

import numba
import numpy as np

from restore.mesh.adjacency import Adjacency, Sides, adjacency, inner_vertices
from restore.mesh.jets import SIGMAS
from restore.mesh.measures import corner_angles
from restore.numerics import SMALL
from restore.robust import MAD_TO_SIGMA
from restore.scan import Floats, Ints

MOST_WAYS = 2048  # to close a fan of twelve faces, which are all tried; other fans tell of the faces of larger ones
BY_CHANCE = 0.05  # fans that close by chance in one of their ways: if more may, that one does is no evidence


class Corners(NamedTuple):
    """The angles (3·m,) rad at the corners of faces row by row, and those around each vertex.

    chance  rad, gaps up to which are closed.
    ways    signs of a fan that are tried: of more some would close by chance.
    """

    angles: Floats
    around: Adjacency
    chance: float
    ways: float


class Groups(NamedTuple):
    """Faces (m,) of which is known whether they lie as another of their group, the parent, does: turn 1, or not: −1."""

    parent: Ints
    turn: Floats


@numba.njit(cache=True)
def closing_signs(faces: Ints, sides: Sides, lengths: Floats, signs: Floats) -> Floats:
    """(m,) the signs of faces with which the fans of inner vertices close; signs (m,) are those by the normals.

    Which way round a group of faces lies is told by the normals of most of them. 0 for a face of which no fan tells.
    """
    inner = inner_vertices(sides, faces.max() + 1)
    angles, gaps, upright = corner_angles(faces, sides, lengths), np.zeros(len(inner)), inner.copy()
    for corner, i in enumerate(faces.ravel()):
        gaps[i] += signs[corner // 3] * angles[corner]
        upright[i] &= signs[corner // 3] > 0.0
    fans, gaps = np.flatnonzero(inner), np.array([_gap(gap) for gap in gaps])
    chance = SIGMAS * MAD_TO_SIGMA * np.median(gaps[fans]) + SMALL
    closed = gaps <= chance
    ways = min(BY_CHANCE * pi / (chance * max((~closed[fans]).sum(), 1)), MOST_WAYS)
    if closed[fans].all() or ways < 4.0:  # those of the smallest fan, of three faces
        return signs
    corners = Corners(angles, adjacency(faces.ravel(), np.arange(len(angles)), len(inner)), chance, ways)
    groups = Groups(np.arange(len(faces)), np.ones(len(faces)))
    for sure in (closed & upright, closed):  # two faces folded onto each other close it with each other's signs, too
        for i in fans[sure[fans]]:
            own, _ = _told(i, corners)
            _join(own, signs[own], groups)
        fans, asked = fans[~sure[fans]], -1
        while len(fans) != asked:  # what one fan tells may leave its neighbour but one way to close
            asked = len(fans)
            fans = fans[np.array([not _settled(i, corners, groups) for i in fans], np.bool_)]
    return _turned(signs, groups)


@numba.njit(cache=True)
def _told(i: int, corners: Corners) -> tuple[Ints, Floats]:
    """The faces (k,) at vertex i whose signs its fan can tell, and their angles (k,) rad there: more than chance."""
    own = corners.around.items[corners.around.start[i] : corners.around.start[i + 1]]
    own = own[2.0 * corners.angles[own] > corners.chance]
    return own // 3, corners.angles[own]


@numba.njit(cache=True)
def _settled(i: int, corners: Corners, groups: Groups) -> bool:
    """Whether the fan of vertex i has no more to tell: it closes in one way that agrees with what is known, or in none.

    One way joins its faces to a group, in place.
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
    """The face that stands for the group of face f, and whether f lies as it does: 1, or −1."""
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
def _turned(signs: Floats, groups: Groups) -> Floats:
    """(m,) the signs of faces by their groups, each turned to agree with most of the signs (m,) given; 0 for a group of
    one."""
    ways, roots, speaks = np.empty(len(signs)), np.empty(len(signs), np.int64), np.zeros(len(signs))
    for f in range(len(signs)):
        roots[f], ways[f] = _root(f, groups)
        speaks[roots[f]] += ways[f] * signs[f]
    of_one = np.bincount(roots) == 1
    return np.where(of_one[roots], 0.0, np.where(speaks[roots] < 0.0, -ways, ways))


@numba.njit(cache=True)
def _gap(angle: float) -> float:
    """How far an angle is from the nearest multiple of 2π."""
    return abs(angle - 2.0 * pi * floor(angle / (2.0 * pi) + 0.5))
