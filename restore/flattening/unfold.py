"""Turn back the triangles that fell on their face.

Sticks alone cannot tell a corner of the border from its mirror image: all its lengths are right on either side. Inside
the page a triangle falls over where lengths contradict each other, mostly over a crease that its vertices missed.
"""

from __future__ import annotations

import numba
import numpy as np

from restore.flattening.kernels import SMALL
from restore.mesh.adjacency import Adjacency, adjacency, faces_around
from restore.mesh.measures import flipped_faces, signed_areas
from restore.scan import Floats, Ints, Mask

AVERAGINGS = 10  # between two looks at what is still flipped
LOOKS = 12  # each may take in more of what is round a tangle
EASINGS = 25  # sweeps; a tangle and its neighbours are a few vertices wide
HALVINGS = 6  # of a move, before it is given up
SLIMMEST = 0.02  # of the middle face's area: no face gets slimmer, or rounding could turn it over


def unfold(flat: Floats, faces: Ints, edges: Ints) -> int:
    """Mirror the loosest corner of every flipped face at the border over its other two, in place; how many there were.

    flat (n, 2) mm, faces (m, 3) counter-clockwise on the page, edges (e, 2); the loosest corner is the one that fewest
    faces share.
    """
    flipped = np.flatnonzero(signed_areas(flat, faces) < 0.0)  # a face without area has no side to fall on
    if len(flipped) == 0:
        return 0
    shared = np.bincount(faces.ravel(), minlength=len(flat))
    border = np.bincount(edges.ravel(), minlength=len(flat)) != shared
    turned = set()
    for face in faces[flipped]:
        apex = face[np.argmin(shared[face])]
        if apex in turned or not border[apex]:  # two faces of one corner: mirrored twice it would be where it was
            continue
        turned.add(apex)
        start, end = flat[face[face != apex]]
        along = (end - start) / max(float(np.linalg.norm(end - start)), np.finfo(float).tiny)
        offset = flat[apex] - start
        flat[apex] = start + 2.0 * (offset @ along) * along - offset
    return len(turned)


def untangle(flat: Floats, faces: Ints, edges: Ints, lengths: Floats) -> Floats:
    """Flat positions (n, 2) mm with fewer faces (m, 3) flipped, if that can be: their corners go amid their neighbours.

    It costs the edges (e, 2) there their lengths (e,) mm, as few and as little as can be, and is the last resort.
    """
    before, flat, count = flat, flat.copy(), len(flat)
    ways = adjacency(edges.ravel(), np.repeat(np.arange(len(edges)), 2), count)
    around = faces_around(faces, count)
    inner = np.diff(ways.start) == np.diff(around.start)  # at the border is an edge more; it would be drawn in
    moved = amid_neighbours(flat, faces, edges, ways, inner)
    near = moved.copy()
    near[edges[moved[edges].any(axis=1)]] = True
    least = SLIMMEST * np.median(np.abs(signed_areas(flat, faces)))
    ease(flat, faces, edges, lengths, ways, around, np.flatnonzero(near), float(least), EASINGS)
    return flat if flipped_faces(flat, faces) < flipped_faces(before, faces) else before


@numba.njit(cache=True)
def amid_neighbours(flat: Floats, faces: Ints, edges: Ints, ways: Adjacency, inner: Mask) -> Mask:
    """Put the corners (n, 2) of flipped faces amid their neighbours, in place; which they are (n,).

    ways are the edges at every vertex; those that are not inner (n,) stay as long as that may do.
    """
    loose = np.zeros(len(flat), np.bool_)
    for look in range(LOOKS):
        flipped = signed_areas(flat, faces) < 0.0
        if not flipped.any():
            break
        for f in np.flatnonzero(flipped):
            for i in faces[f]:
                loose[i] = True
        moving = np.flatnonzero(loose & (inner if look <= LOOKS // 2 else loose))  # drawn in is better than folded
        for _ in range(AVERAGINGS):
            for i in moving:
                x, y, count = 0.0, 0.0, ways.start[i + 1] - ways.start[i]
                for q in range(ways.start[i], ways.start[i + 1]):
                    k = ways.items[q]
                    other = edges[k, 0] + edges[k, 1] - i
                    x += flat[other, 0] / count
                    y += flat[other, 1] / count
                flat[i, 0], flat[i, 1] = x, y
    return loose


@numba.njit(cache=True)
def ease(
    flat: Floats,
    faces: Ints,
    edges: Ints,
    lengths: Floats,
    ways: Adjacency,
    around: Adjacency,
    moving: Ints,
    least: float,
    sweeps: int,
) -> None:
    """Relax the sticks at the moving vertices (k,), flat (n, 2) in place, each as far as no face gets below `least`.

    ways and around are the edges and the faces at every vertex.
    """
    for _ in range(sweeps):
        for i in moving:
            x, y, count = 0.0, 0.0, max(ways.start[i + 1] - ways.start[i], 1)
            for q in range(ways.start[i], ways.start[i + 1]):
                k = ways.items[q]
                other = edges[k, 0] + edges[k, 1] - i
                off_x, off_y = flat[other, 0] - flat[i, 0], flat[other, 1] - flat[i, 1]
                share = 1.0 - lengths[k] / (np.sqrt(off_x * off_x + off_y * off_y) + SMALL)
                x += share * off_x / count
                y += share * off_y / count
            was_x, was_y = flat[i, 0], flat[i, 1]
            before = _slimmest(i, flat, faces, around)
            step = 1.0
            for _ in range(HALVINGS):
                flat[i, 0], flat[i, 1] = was_x + step * x, was_y + step * y
                if _slimmest(i, flat, faces, around) >= min(least, before):
                    break
                step *= 0.5
            else:
                flat[i, 0], flat[i, 1] = was_x, was_y


@numba.njit(cache=True)
def _slimmest(i: int, flat: Floats, faces: Ints, around: Adjacency) -> float:
    """The least signed area of the faces at vertex i."""
    least = np.inf
    for q in range(around.start[i], around.start[i + 1]):
        a, b, c = faces[around.items[q]]
        ux, uy = flat[b, 0] - flat[a, 0], flat[b, 1] - flat[a, 1]
        vx, vy = flat[c, 0] - flat[a, 0], flat[c, 1] - flat[a, 1]
        least = min(least, 0.5 * (ux * vy - uy * vx))
    return least
