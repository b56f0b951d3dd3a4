"""Turn back the faces that a least-strain page has inverted.

Lengths alone cannot tell a corner of the border from its mirror image. Inside the page a face inverts where lengths
contradict each other, mostly over a crease that no vertex samples. A face that is folded over in space is inverted on
the page too, and rightly so: its sign is negative, and it is left alone.
"""

from __future__ import annotations

import numba
import numpy as np

from restore.flattening.gauss_newton import minimise_strain
from restore.flattening.solution import Solution
from restore.mesh.adjacency import Adjacency, adjacency, faces_around
from restore.mesh.measures import signed_areas
from restore.mesh.network import Network
from restore.numerics import SMALL
from restore.scan import Floats, Ints, Mask

MIRRORINGS = 5  # each frees the corners that the last one still held
AVERAGINGS = 10  # between two searches for what is still inverted
SEARCHES = 12  # each may take in more of what lies round an inversion
SWEEPS = 50  # of Gauss–Seidel over an inversion and its neighbours, a few vertices wide
HALVINGS = 6  # of the step of a vertex, before it stays where it is
SLIMMEST = 0.02  # of the median face: no face gets smaller, or rounding could turn it over


def least_strain_page(flat: Floats, network: Network, signs: Floats | None = None) -> Solution:
    """The flat positions (n, 2) mm of least strain near a start, without inverted faces where that can be had.

    signs (m,) are −1 for the faces that are folded in space; all are 1 when None.
    """
    faces, edges = network.faces, network.edges
    signs = np.ones(len(faces)) if signs is None else signs
    found = minimise_strain(flat, network)
    iterations, inverted = found.iterations, inverted_count(found.flat, faces, signs)
    for _ in range(MIRRORINGS if inverted else 0):
        mirrored = found.flat.copy()
        if not mirror_border_corners(mirrored, faces, edges, signs):
            break
        again = minimise_strain(mirrored, network)
        iterations += again.iterations
        left = inverted_count(again.flat, faces, signs)
        if left >= inverted:
            break
        found, inverted = again, left
    repaired = uninverted(found.flat, network, signs) if inverted else found.flat
    return found._replace(flat=repaired, iterations=iterations)


@numba.njit(cache=True)
def inverted_count(flat: Floats, faces: Ints, signs: Floats) -> int:
    """How many faces (m, 3) of flat (n, 2) lie against their sign (m,); a face without area has none."""
    return int((signed_areas(flat, faces) * signs < 0.0).sum())


def mirror_border_corners(flat: Floats, faces: Ints, edges: Ints, signs: Floats) -> int:
    """Mirror the loosest corner of every inverted face at the border over its other two, in place; how many there were.

    flat (n, 2) mm; the loosest corner is the one that fewest faces share.
    """
    inverted = np.flatnonzero(signed_areas(flat, faces) * signs < 0.0)
    if len(inverted) == 0:
        return 0
    shared = np.bincount(faces.ravel(), minlength=len(flat))
    border = np.bincount(edges.ravel(), minlength=len(flat)) != shared
    mirrored = set()
    for face in faces[inverted]:
        apex = face[np.argmin(shared[face])]
        if apex in mirrored or not border[apex]:  # two faces of one corner: mirrored twice it would be where it was
            continue
        mirrored.add(apex)
        start, end = flat[face[face != apex]]
        along = (end - start) / max(float(np.linalg.norm(end - start)), np.finfo(float).tiny)
        offset = flat[apex] - start
        flat[apex] = start + 2.0 * (offset @ along) * along - offset
    return len(mirrored)


def uninverted(flat: Floats, network: Network, signs: Floats) -> Floats:
    """Flat positions (n, 2) mm with fewer inverted faces, if that can be; only vertices near them are moved.

    Their corners go to the mean of their neighbours until nothing is inverted, then each to where its edges are
    strained least without inverting a face again.
    """
    faces, edges, lengths = network.faces, network.edges, network.lengths
    before, flat, count = flat, flat.copy(), len(flat)
    edges_at = adjacency(edges.ravel(), np.repeat(np.arange(len(edges)), 2), count)
    around = faces_around(faces, count)
    inner = np.diff(edges_at.start) == np.diff(around.start)  # at the border is an edge more; it would be drawn in
    moved = average_inverted(flat, faces, signs, edges, edges_at, inner)
    near = moved.copy()
    near[edges[moved[edges].any(axis=1)]] = True
    least = float(SLIMMEST * np.median(np.abs(signed_areas(flat, faces))))
    relax_uninverted(flat, faces, signs, edges, lengths, edges_at, around, np.flatnonzero(near), least, SWEEPS)
    return flat if inverted_count(flat, faces, signs) < inverted_count(before, faces, signs) else before


@numba.njit(cache=True)
def average_inverted(flat: Floats, faces: Ints, signs: Floats, edges: Ints, edges_at: Adjacency, inner: Mask) -> Mask:
    """Move the corners of inverted faces to the mean of their neighbours, in place; which vertices (n,) were moved.

    Those that are not inner (n,) stay as long as that may do.
    """
    loose = np.zeros(len(flat), np.bool_)
    for search in range(SEARCHES):
        inverted = signed_areas(flat, faces) * signs < 0.0
        if not inverted.any():
            break
        for f in np.flatnonzero(inverted):
            for i in faces[f]:
                loose[i] = True
        moving = np.flatnonzero(loose & (inner if search <= SEARCHES // 2 else loose))
        for _ in range(AVERAGINGS):
            for i in moving:
                x, y, count = 0.0, 0.0, edges_at.start[i + 1] - edges_at.start[i]
                for q in range(edges_at.start[i], edges_at.start[i + 1]):
                    k = edges_at.items[q]
                    other = edges[k, 0] + edges[k, 1] - i
                    x += flat[other, 0] / count
                    y += flat[other, 1] / count
                flat[i, 0], flat[i, 1] = x, y
    return loose


@numba.njit(cache=True)
def relax_uninverted(
    flat: Floats,
    faces: Ints,
    signs: Floats,
    edges: Ints,
    lengths: Floats,
    edges_at: Adjacency,
    around: Adjacency,
    moving: Ints,
    least: float,
    sweeps: int,
) -> None:
    """Relax the edges at the moving vertices (k,), flat (n, 2) in place, each as far as no face gets below `least`."""
    for _ in range(sweeps):
        for i in moving:
            x, y, count = 0.0, 0.0, max(edges_at.start[i + 1] - edges_at.start[i], 1)
            for q in range(edges_at.start[i], edges_at.start[i + 1]):
                k = edges_at.items[q]
                other = edges[k, 0] + edges[k, 1] - i
                off_x, off_y = flat[other, 0] - flat[i, 0], flat[other, 1] - flat[i, 1]
                share = 1.0 - lengths[k] / (np.sqrt(off_x * off_x + off_y * off_y) + SMALL)
                x += share * off_x / count
                y += share * off_y / count
            was_x, was_y = flat[i, 0], flat[i, 1]
            before = _smallest(i, flat, faces, signs, around)
            step = 1.0
            for _ in range(HALVINGS):
                flat[i, 0], flat[i, 1] = was_x + step * x, was_y + step * y
                if _smallest(i, flat, faces, signs, around) >= min(least, before):
                    break
                step *= 0.5
            else:
                flat[i, 0], flat[i, 1] = was_x, was_y


@numba.njit(cache=True)
def _smallest(i: int, flat: Floats, faces: Ints, signs: Floats, around: Adjacency) -> float:
    """The least area of the faces at vertex i, negative for one that lies against its sign."""
    least = np.inf
    for q in range(around.start[i], around.start[i + 1]):
        a, b, c = faces[around.items[q]]
        ux, uy = flat[b, 0] - flat[a, 0], flat[b, 1] - flat[a, 1]
        vx, vy = flat[c, 0] - flat[a, 0], flat[c, 1] - flat[a, 1]
        least = min(least, 0.5 * signs[around.items[q]] * (ux * vy - uy * vx))
    return least
