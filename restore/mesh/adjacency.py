"""Adjacency of the elements of a mesh, by counting sort, in a tenth of the time of comparison sort."""

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
    """The sides (half-edges) of faces (m, 3) and their edges. Side 3·f + k runs from corner k of face f to the next.

    edges   (e, 2): each edge once, the smaller vertex first, in ascending order.
    at      (h,): the sides grouped by edge, in the order of the edges.
    first   (e + 1,): offsets of the groups in `at`, and its length.
    edge    (3·m,): index of the edge of each side; −1 for a side of a repeated vertex.
    """

    edges: Ints
    at: Ints
    first: Ints
    edge: Ints


@numba.njit(cache=True)
def adjacency(rows: Ints, items: Ints, count: int) -> Adjacency:
    """Items (k,) grouped by rows (k,), each less than `count`, in their original order."""
    start = np.zeros(count + 1, np.int64)
    for row in rows:
        start[row + 1] += 1
    for row in range(count):
        start[row + 1] += start[row]
    grouped, filled = np.empty(len(items), np.int64), start.copy()
    for k in range(len(rows)):
        grouped[filled[rows[k]]] = items[k]
        filled[rows[k]] += 1
    return Adjacency(start, grouped)


@numba.njit(cache=True)
def neighbours_of(edges: Ints, count: int) -> Adjacency:
    """The neighbours of each of `count` vertices over edges (e, 2)."""
    source, target = np.empty(2 * len(edges), np.int64), np.empty(2 * len(edges), np.int64)
    for k in range(len(edges)):
        source[2 * k], target[2 * k] = edges[k, 0], edges[k, 1]
        source[2 * k + 1], target[2 * k + 1] = edges[k, 1], edges[k, 0]
    return adjacency(source, target, count)


@numba.njit(cache=True)
def faces_around(faces: Ints, count: int) -> Adjacency:
    """The faces (m, 3) at each of `count` vertices."""
    return adjacency(faces.ravel(), np.arange(3 * len(faces)) // 3, count)


@numba.njit(cache=True)
def order_of_pairs(first: Ints, second: Ints, count: int) -> Ints:
    """(k,) indices that sort pairs of vertices, each less than `count`, in ascending order; the sort is stable."""
    table = adjacency(first, np.arange(len(first)), count)
    order = table.items
    for row in range(count):  # insertion sort: a vertex has few edges
        for k in range(table.start[row] + 1, table.start[row + 1]):
            item, place = order[k], k
            while place > table.start[row] and second[order[place - 1]] > second[item]:
                order[place] = order[place - 1]
                place -= 1
            order[place] = item
    return order


@numba.njit(cache=True)
def sides_of(faces: Ints) -> Sides:
    """The sides of faces (m, 3) grouped by edge."""
    count = 3 * len(faces)
    low, high, last_vertex = np.empty(count, np.int64), np.empty(count, np.int64), -1
    for f in range(len(faces)):
        for k in range(3):
            a, b = faces[f, k], faces[f, (k + 1) % 3]
            low[3 * f + k], high[3 * f + k] = min(a, b), max(a, b)
            last_vertex = max(last_vertex, a)
    edges, at, first = np.empty((count, 2), np.int64), np.empty(count, np.int64), np.empty(count + 1, np.int64)
    edge = np.full(count, -1)
    e, filled = -1, 0
    for side in order_of_pairs(low, high, last_vertex + 1):
        if low[side] == high[side]:
            continue
        if e < 0 or edges[e, 0] != low[side] or edges[e, 1] != high[side]:
            e += 1
            edges[e, 0], edges[e, 1], first[e] = low[side], high[side], filled
        at[filled], edge[side] = side, e
        filled += 1
    first[e + 1] = filled
    return Sides(edges[: e + 1].copy(), at[:filled].copy(), first[: e + 2].copy(), edge)


@numba.njit(cache=True)
def inner_vertices(sides: Sides, count: int) -> Mask:
    """(count,) whether a vertex has edges, and all of them two faces."""
    inner = np.zeros(count, np.bool_)
    for edge in sides.edges:
        inner[edge[0]] = inner[edge[1]] = True
    for e in range(len(sides.edges)):
        if sides.first[e + 1] - sides.first[e] != 2:
            inner[sides.edges[e, 0]] = inner[sides.edges[e, 1]] = False
    return inner


def used_vertices(faces: Ints, count: int) -> Mask:
    """(count,) True for the vertices that faces (m, 3) use."""
    used = np.zeros(count, bool)
    used[faces] = True
    return used


def border_of(faces: Ints) -> Ints:
    """Vertices on the border of faces (m, 3), in ascending order: the ends of edges of one face only."""
    sides = sides_of(faces)
    return np.unique(sides.edges[np.diff(sides.first) == 1])


@numba.njit(cache=True)
def components(pairs: Ints, count: int) -> Ints:
    """(count,) connected component of each of `count` nodes joined by pairs (k, 2), numbered by first node."""
    root = np.arange(count)
    for k in range(len(pairs)):
        a, b = pairs[k, 0], pairs[k, 1]
        while root[a] != a:
            root[a] = root[root[a]]
            a = root[a]
        while root[b] != b:
            root[b] = root[root[b]]
            b = root[b]
        root[max(a, b)] = min(a, b)
    part_count = 0
    for i in range(count):  # the root of a component is its first node: numbered before the others read it
        if root[i] == i:
            root[i], part_count = part_count, part_count + 1
        else:
            root[i] = root[root[i]]
    return root


def piece_of_faces(faces: Ints) -> Ints:
    """(m,) the connected piece that each of the faces (m, 3) belongs to; those that share a vertex are of one."""
    return components(np.concatenate([faces[:, :2], faces[:, 1:]]), int(faces.max(initial=-1)) + 1)[faces[:, 0]]
