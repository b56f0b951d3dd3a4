"""Flat page from edge lengths alone: angle synchronisation, then Poisson.

It needs no start. Every fan has its own frame; the direction of an edge in the frames at both of its ends gives the
rotation between the two frames. The rotations that agree best with all edges are the least squares on the circle
(angular synchronisation, Singer 2011), here started from the paths of least variance (Dijkstra 1959), with residuals
wrapped to ±π. Rotated into one frame, the edges are vectors, and the positions that agree best with those solve a
Poisson equation. Both systems have the same matrix, factorised once, unless a vertex has several fans.
"""

from __future__ import annotations

import numba
import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import SuperLU, splu

from restore.flattening.isometric.fans import Fans
from restore.mesh.adjacency import Adjacency, adjacency
from restore.numerics.limits import SMALL
from restore.scan import Floats, Ints, Mask

SHORTEST = 1e-3  # of the mean: shorter edges and smaller areas count as this, or rounding would decide the rest


def flat_from_lengths(fans: Fans, lengths: Floats, count: int) -> Floats:
    """Flat positions (count, 2) mm of `count` vertices whose edges have lengths (e,) mm."""
    along = lengths[fans.edge]
    weights = np.maximum(along / along.mean(), SHORTEST) ** -2.0
    weights /= weights.mean()
    of_vertices = _factorised(fans.ends, weights, count)
    manifold = len(fans.owner) == count and len(np.unique(fans.owner)) == count  # one fan for each vertex
    frames, frame_count = (fans.ends, count) if manifold else (fans.fans, len(fans.owner))
    of_frames = of_vertices if manifold else _factorised(frames, weights, frame_count)
    turns = _synchronised(frames, fans.angles, weights, of_frames, frame_count)
    vectors = _vectors(turns[frames] + fans.angles, along)
    return np.asarray(of_vertices.solve(_divergence(fans.ends, weights[:, None] * vectors, count)))


def _factorised(pairs: Ints, weights: Floats, count: int) -> SuperLU:
    a, b = pairs.T
    stiffness = np.bincount(a, weights, count) + np.bincount(b, weights, count)
    stiffness += SMALL * stiffness.mean()  # a component as a whole has none
    own = np.arange(count)
    entries = np.concatenate([-weights, -weights, stiffness])
    places = np.concatenate([a, b, own]), np.concatenate([b, a, own])
    laplacian = csc_matrix((entries, places), shape=(count, count))
    # Without supernodes: these matrices have few, and looking for them takes a third of the time.
    options = {"SymmetricMode": True, "PanelSize": 1, "Relax": 1}
    return splu(laplacian, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)


def _synchronised(frames: Ints, angles: Floats, weights: Floats, solver: SuperLU, count: int) -> Floats:
    """Return the rotation (count,) of each frame, rad."""
    turn = angles[:, 0] - angles[:, 1] - np.pi
    around = adjacency(frames.ravel(), np.repeat(np.arange(len(frames)), 2), count)
    turns, squares = along_tree(frames, turn, 1.0 / weights, around), np.inf
    while True:
        rest = turns[frames[:, 0]] + turn - turns[frames[:, 1]]
        rest -= 2.0 * np.pi * np.round(rest / (2.0 * np.pi))
        squares, before = float((weights * rest**2).sum()), squares
        if squares > before - SMALL * len(rest):  # linear in the turns but for the wraps, which no longer change
            break
        turns = turns + solver.solve(_divergence(frames, (weights * rest)[:, None], count))[:, 0]
    return turns


def along_tree(frames: Ints, turn: Floats, variances: Floats, around: Adjacency) -> Floats:
    """Return the rotation of each frame along a minimum-variance tree.

    Joints of the least total variance lead from the first frame of each component.
    frames: (j, 2), of the joints.
    turn: (j,) rad, between them.
    variances: (j,); short edges determine rotations better than a long one does.
    Returns (n,) rad.
    """
    count, most = len(around.start) - 1, len(around.items) + 1
    turns, seen = np.zeros(count), np.zeros(count, bool)
    waiting = np.empty(most, np.int64), np.empty(most), np.empty(most, np.int64), np.empty(most)
    _follow_tree(frames, turn, variances, *around, turns, seen, *waiting)
    return turns


@numba.njit(cache=True)
def _follow_tree(
    frames: Ints, turn: Floats, variances: Floats, start: Ints, items: Ints, turns: Floats, seen: Mask,
    heap: Ints, total: Floats, frame: Ints, turned: Floats,
) -> None:  # fmt: skip
    """Write the rotations (n,), following the paths in order of variance.

    heap: (k,), binary heap of the waiting paths: of total (k,) variance, to a frame (k,) that is rotated (k,) by it.
    """
    for root in range(len(turns)):
        if seen[root]:
            continue
        size, known = 1, 1
        heap[0], total[0], frame[0], turned[0] = 0, 0.0, root, 0.0
        while size > 0:
            way, size = heap[0], size - 1
            _sink(heap, size, total, frame, turned)
            i = frame[way]
            if seen[i]:
                continue
            seen[i], turns[i] = True, turned[way]
            for q in range(start[i], start[i + 1]):
                joint = items[q]
                k = frames[joint, 0] + frames[joint, 1] - i
                if not seen[k]:
                    onward = turn[joint] if frames[joint, 0] == i else -turn[joint]
                    total[known], frame[known], turned[known] = total[way] + variances[joint], k, turned[way] + onward
                    _rise(heap, size, known, total, frame, turned)
                    size, known = size + 1, known + 1


@numba.njit(cache=True)
def _before(one: int, other: int, total: Floats, frame: Ints, turned: Floats) -> bool:
    """Return whether one path comes before the other.

    Of two with the same variance it is the one to the frame with the smaller number.
    """
    if total[one] != total[other]:
        return bool(total[one] < total[other])
    if frame[one] != frame[other]:
        return bool(frame[one] < frame[other])
    return bool(turned[one] < turned[other])


@numba.njit(cache=True, inline="always")
def _rise(heap: Ints, size: int, way: int, total: Floats, frame: Ints, turned: Floats) -> None:
    """Put a way into the heap of a size."""
    place = size
    while place > 0 and _before(way, heap[(place - 1) // 2], total, frame, turned):
        heap[place] = heap[(place - 1) // 2]
        place = (place - 1) // 2
    heap[place] = way


@numba.njit(cache=True, inline="always")
def _sink(heap: Ints, size: int, total: Floats, frame: Ints, turned: Floats) -> None:
    """Replace the first path of the heap by the last, and sink it.

    size: of the heap without the last.
    """
    place, child, way = 0, 1, heap[size]
    while child < size:
        if child + 1 < size and _before(heap[child + 1], heap[child], total, frame, turned):
            child += 1
        if not _before(heap[child], way, total, frame, turned):
            break
        heap[place] = heap[child]
        place, child = child, 2 * child + 1
    heap[place] = way


def _vectors(directions: Floats, lengths: Floats) -> Floats:
    """Return the vectors of joints, the mean of those from both ends.

    directions: (j, 2) rad, outward from both ends. Returns (j, 2) mm.
    """
    found = np.stack([np.cos(directions), np.sin(directions)], axis=-1)
    mean = found[:, 0] - found[:, 1]
    return np.asarray(mean * (lengths / np.maximum(np.linalg.norm(mean, axis=1), SMALL))[:, None])


def _divergence(pairs: Ints, flows: Floats, count: int) -> Floats:
    """Return the divergence of flows over pairs of nodes.

    pairs: (j, 2).
    flows: (j, d), from the first of each pair to the second.
    Returns (count, d).
    """
    a, b = pairs.T
    return np.stack([np.bincount(b, f, count) - np.bincount(a, f, count) for f in flows.T], axis=1)
