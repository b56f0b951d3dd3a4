"""Signs of the faces that are folded over, from the lengths of their sides alone.

The signed angles round an inner vertex add up to 2π, or to 0 where it lies outside its neighbours. Where they do not,
the normals have misled: a sign of a face there is wrong.
"""

from __future__ import annotations

from math import floor, pi
from typing import NamedTuple

import numba
import numpy as np

from restore.mesh.adjacency import Adjacency, Sides, faces_around, inner_vertices
from restore.mesh.jets import SIGMAS
from restore.mesh.measures import corner_angles
from restore.numerics import SMALL
from restore.robust import MAD_TO_SIGMA
from restore.scan import Floats, Ints, Mask

EVIDENCE = 0.5  # of what wrong signs would close if no others were wrong; the rest speaks for the signs as they were
MOST_FACES = 10  # round a vertex that are chosen from together, in a thousand ways; of more, one ten after the other


class Corners(NamedTuple):
    """faces (m, 3), their angles (3·m,) rad row by row, which vertices are inner (n,), and the faces around each."""

    faces: Ints
    angles: Floats
    inner: Mask
    around: Adjacency


@numba.njit(cache=True)
def closing_signs(faces: Ints, sides: Sides, lengths: Floats, signs: Floats) -> Floats:
    """(m,) the signs of faces with which the fans of inner vertices close best.

    They are looked for from the signs by the normals, and where those are contradicted from a sheet without folds too.
    """
    inner = inner_vertices(sides, faces.max() + 1)
    corners = Corners(faces, corner_angles(faces, sides, lengths), inner, faces_around(faces, len(inner)))
    by_normals, upright = signs.copy(), np.ones(len(signs))
    open_by = _close(by_normals, corners)
    return by_normals if (by_normals == signs).all() or open_by <= _close(upright, corners) else upright


@numba.njit(cache=True)
def _close(signs: Floats, corners: Corners) -> float:
    """By how much, rad, the fans of all inner vertices stay open when signs (m,) are turned, in place."""
    fans, gaps, around = np.flatnonzero(corners.inner), np.zeros(len(corners.inner)), corners.around
    for corner, i in enumerate(corners.faces.ravel()):
        gaps[i] += signs[corner // 3] * corners.angles[corner]
    # Where most fans are open, half of what an equilateral face with a wrong sign opens at a corner.
    chance = min(SIGMAS * MAD_TO_SIGMA * np.median(np.array([_gap(gaps[i]) for i in fans])), pi / 3.0)
    after, changes, turned = gaps.copy(), np.empty(1 << MOST_FACES), 1
    while turned:  # signs that are turned may free those of their neighbours; each closes the fans further
        turned = 0
        for i in fans:
            for q in range(around.start[i], around.start[i + 1], MOST_FACES):
                if _gap(gaps[i]) > chance:
                    own = around.items[q : min(q + MOST_FACES, around.start[i + 1])]
                    turned += _turned(i, own, corners, signs, gaps, after, changes, chance)
    return float(np.array([_gap(gaps[i]) for i in fans]).sum())


@numba.njit(cache=True)
def _turned(
    i: int, own: Ints, corners: Corners, signs: Floats, gaps: Floats, after: Floats, changes: Floats, chance: float
) -> bool:
    """Turn the signs (m,) of those of own faces (k,) of vertex i that close the fans most clearly; whether any do.

    They must close more than chance (rad, each), and more than a share, EVIDENCE, of what is open at i and of what they
    would close if no others were wrong. gaps (n,) are the sums of signed angles round every vertex, after (n,) a copy;
    changes (·,) what turning faces takes from that at i, told by the bits of its index. Both are written over.
    """
    faces, angles, gap, found, most = corners.faces, corners.angles, _gap(gaps[i]), 0, EVIDENCE
    changes[0] = 0.0
    for q, f in enumerate(own):
        c = 0 if faces[f, 0] == i else 1 if faces[f, 1] == i else 2
        for chosen in range(1 << q):
            changes[chosen + (1 << q)] = changes[chosen] + 2.0 * signs[f] * angles[3 * f + c]
    for chosen in range(1, 1 << len(own)):
        if gap - _gap(gaps[i] - changes[chosen]) > EVIDENCE * max(gap, _gap(changes[chosen])):
            _turn(chosen, own, corners, signs, after)
            share = _closed(chosen, own, corners, gaps, after, chance)
            if share > most:
                found, most = chosen, share
    _turn(found, own, corners, signs, gaps)
    _turn(found, own, corners, signs, after)
    for q, f in enumerate(own):
        signs[f] = -signs[f] if found >> q & 1 else signs[f]
    return found > 0


@numba.njit(cache=True)
def _turn(chosen: int, own: Ints, corners: Corners, signs: Floats, gaps: Floats) -> None:
    """Take from the gaps (n,) what turning the chosen of a vertex's own faces (k,), told by bits, takes from them."""
    for q, f in enumerate(own):
        if chosen >> q & 1:
            for c in range(3):
                gaps[corners.faces[f, c]] -= 2.0 * signs[f] * corners.angles[3 * f + c]


@numba.njit(cache=True)
def _closed(chosen: int, own: Ints, corners: Corners, gaps: Floats, after: Floats, chance: float) -> float:
    """What turning the chosen faces closes, as a share of what it would if no others were wrong.

    0 if it may be chance, or if fewer fans than signs tell, as in the corner of a grid. gaps (n,) before, and after,
    which are made equal again.
    """
    gain, most, turned, told = 0.0, SMALL, 0, 0
    for q, f in enumerate(own):
        if chosen >> q & 1:
            turned += 1
            for i in corners.faces[f]:
                if corners.inner[i] and after[i] != gaps[i]:
                    gain += _gap(gaps[i]) - _gap(after[i])
                    most += _gap(gaps[i] - after[i])
                    told += 1
                after[i] = gaps[i]  # which counts a corner of several faces once
    return gain / most if told >= turned and gain > turned * chance else 0.0


@numba.njit(cache=True)
def _gap(angle: float) -> float:
    """How far an angle is from the nearest multiple of 2π."""
    return abs(angle - 2.0 * pi * floor(angle / (2.0 * pi) + 0.5))
