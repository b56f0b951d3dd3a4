"""Adjacency of the elements of a mesh, by counting sort.

It takes a tenth of the time of a comparison sort.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from restore.scan import Ints, Mask


class Adjacency(NamedTuple):
    """A ragged table (compressed sparse rows): row i is items[start[i] : start[i + 1]]."""

    start: Ints
    items: Ints


class Sides(NamedTuple):
    """Sides (half-edges) of faces (m, 3) and their edges.

    Side 3·f + k runs from corner k of face f to the next.

    edges   (e, 2): each edge once, the smaller vertex first, in ascending order.
    at      (h,): the sides grouped by edge, in the order of the edges.
    first   (e + 1,): offsets of the groups in `at`, and its length.
    edge    (3·m,): index of the edge of each side; −1 for a side of a repeated vertex.
    """

    edges: Ints
    at: Ints
    first: Ints
    edge: Ints


def adjacency(rows: Ints, items: Ints, count: int) -> Adjacency:
    """Items (k,) grouped by rows (k,), each less than `count`, in their original order."""
    rows, items = (np.ascontiguousarray(column, np.int64) for column in (rows, items))
    start, grouped = np.zeros(count + 1, np.int64), np.empty(len(items), np.int64)
    np.cumsum(np.bincount(rows, minlength=count), out=start[1:])
    _group(rows, items, start.copy(), grouped)
    return Adjacency(start, grouped)


@numba.njit(cache=True)
def _group(rows: Ints, items: Ints, filled: Ints, grouped: Ints) -> None:
    """Write items (k,) grouped by rows (k,).

    Each row starts at its place in `filled`, which is moved to its end.
    """
    for k in range(len(rows)):
        row = rows[k]
        grouped[filled[row]] = items[k]
        filled[row] += 1


def neighbours_of(edges: Ints, count: int) -> Adjacency:
    """The neighbours of each of `count` vertices over edges (e, 2)."""
    return adjacency(edges.ravel(), edges[:, ::-1].ravel(), count)


def faces_around(faces: Ints, count: int) -> Adjacency:
    """The faces (m, 3) at each of `count` vertices."""
    return adjacency(faces.ravel(), np.repeat(np.arange(len(faces)), 3), count)


def order_of_pairs(first: Ints, second: Ints, count: int) -> Ints:
    """Return the indices (k,) that sort pairs of vertices.

    In ascending order, stable; each vertex is less than `count`.
    """
    by_second = adjacency(second, np.arange(len(second)), count).items
    return adjacency(first.take(by_second), by_second, count).items


def sides_of(faces: Ints) -> Sides:
    """The sides of faces (m, 3) grouped by edge."""
    ends = np.roll(faces, -1, axis=1)
    low, high = np.minimum(faces, ends).ravel(), np.maximum(faces, ends).ravel()
    at = order_of_pairs(low, high, int(faces.max(initial=-1)) + 1)
    low, high = low.take(at), high.take(at)
    if not (proper := low != high).all():
        low, high, at = low[proper], high[proper], at[proper]
    begins = np.ones(len(at), bool)
    begins[1:] = (low[1:] != low[:-1]) | (high[1:] != high[:-1])
    first, edge = np.append(np.flatnonzero(begins), len(at)), np.full(faces.size, -1)
    edge[at] = np.cumsum(begins) - 1
    return Sides(np.stack([low[begins], high[begins]], axis=1), at, first, edge)


def inner_vertices(sides: Sides, count: int) -> Mask:
    """Return whether each vertex has edges, and all of them two faces, (count,) bool."""
    inner = np.zeros(count, bool)
    inner[sides.edges] = True
    inner[sides.edges[np.diff(sides.first) != 2]] = False
    return inner


def used_vertices(faces: Ints, count: int) -> Mask:
    """Return which vertices faces (m, 3) use, (count,) bool."""
    used = np.zeros(count, bool)
    used[faces] = True
    return used


def components(pairs: Ints, count: int) -> Ints:
    """Return the connected component of each of `count` nodes.

    pairs: (k, 2), of joined nodes. Returns (count,), numbered by first node.
    """
    root = np.arange(count)
    _join(np.ascontiguousarray(pairs, np.int64), root)
    return root


@numba.njit(cache=True)
def _join(pairs: Ints, root: Ints) -> None:
    """Write the component of each node to root (n,).

    pairs: (k, 2), of joined nodes. root holds each node's own number at first.
    """
    for k in range(len(pairs)):
        a, b = pairs[k, 0], pairs[k, 1]
        while root[a] != a:
            root[a] = root[root[a]]
            a = root[a]
        while root[b] != b:
            root[b] = root[root[b]]
            b = root[b]
        if a < b:
            root[b] = a
        else:
            root[a] = b
    part_count = 0
    for i in range(len(root)):  # the root of a component is its first node: numbered before the others read it
        if root[i] == i:
            root[i] = part_count
            part_count += 1
        else:
            root[i] = root[root[i]]


def piece_of_faces(faces: Ints) -> Ints:
    """Return the connected piece (m,) of each of the faces (m, 3).

    Faces that have a vertex in common are of one piece.
    """
    return components(np.concatenate([faces[:, :2], faces[:, 1:]]), int(faces.max(initial=-1)) + 1)[faces[:, 0]]
