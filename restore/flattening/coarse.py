"""A sheet of many points, seen as one of few: cells of neighbours, and the mesh of their middles.

What a sheet looks like from afar is settled by few points, in a hundredth of the time. The cells are grown from their
middles over the mesh, so that a fold or a tear divides them as it divides the sheet; wherever three of them meet, their
middles make a face.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from restore.mesh.adjacency import Adjacency, neighbours_of, sides_of
from restore.mesh.measures import vertex_normals
from restore.mesh.network import Network, make_network
from restore.mesh.surface_lengths import bent_lengths
from restore.scan import Floats, Ints

LEAST_HOPS = 2  # between middles: smaller cells meet in slivers along the border
FLATTEST = 1e-6  # of its mean square: a patch of neighbours in one plane has no extent across it


@dataclass(frozen=True, eq=False)
class Coarse:
    """Few points for many. index (k,): which of the vertices they are; owner (n,): the point each vertex goes with."""

    index: Ints
    owner: Ints
    network: Network

    def carry(self, vertices: Floats, moved: Floats) -> Floats:
        """Where all vertices (n, 3) mm are when the few have moved to (k, d) mm: each goes with its own as if rigid."""
        return _carry(vertices, moved, self.index, self.owner, self.network.edges)


def coarsen(vertices: Floats, network: Network, most: int) -> Coarse | None:
    """The sheet by no more than about `most` points; None where its cells make no mesh that covers it."""
    count = len(vertices)
    hops = max(round(np.sqrt(count / most)) - 1, LEAST_HOPS)
    around = neighbours_of(network.edges, count)
    index, owner = _cells(around, hops)
    faces = _between(owner, network.faces)
    if not np.bincount(faces.ravel(), minlength=len(index)).all():
        return None
    few, sides = vertices[index], sides_of(faces)
    lengths = bent_lengths(few, vertex_normals(vertices, network.faces)[index], sides.edges)
    return Coarse(index, owner, make_network(few, faces, lengths, sides))


@numba.njit(cache=True)
def _cells(around: Adjacency, hops: int) -> tuple[Ints, Ints]:
    """Middles (k,) more than `hops` edges apart, and the nearest of them to each vertex (n,), counted in edges."""
    count = len(around.start) - 1
    near, queue, distance = np.zeros(count, np.bool_), np.empty(count, np.int64), np.empty(count, np.int64)
    seen, index = np.full(count, -1), np.empty(count, np.int64)
    found = 0
    for middle in range(count):
        if near[middle] or around.start[middle] == around.start[middle + 1]:
            continue
        queue[0], distance[middle], seen[middle] = middle, 0, found
        first, last = 0, 1
        while first < last:
            i = queue[first]
            first += 1
            near[i] = True
            for q in range(around.start[i], around.start[i + 1]):
                k = around.items[q]
                if seen[k] != found and distance[i] < hops:
                    seen[k], distance[k], queue[last] = found, distance[i] + 1, k
                    last += 1
        index[found] = middle
        found += 1
    owner = np.full(count, -1)
    for k in range(found):
        owner[index[k]], queue[k] = k, index[k]
    first, last = 0, found
    while first < last:
        i = queue[first]
        first += 1
        for q in range(around.start[i], around.start[i + 1]):
            k = around.items[q]
            if owner[k] < 0:
                owner[k], queue[last] = owner[i], k
                last += 1
    return index[:found].copy(), owner


@numba.njit(cache=True)
def _between(owner: Ints, faces: Ints) -> Ints:
    """(k, 3) the owners of those faces (m, 3) that have three, each three of them once."""
    count, known = owner.max() + 1, {-1}
    found = np.empty_like(faces)
    for f in range(len(faces)):
        a, b, c = owner[faces[f, 0]], owner[faces[f, 1]], owner[faces[f, 2]]
        if a == b or b == c or c == a:
            continue
        low, high = min(a, b, c), max(a, b, c)
        key = (low * count + high) * count + a + b + c - low - high
        if key not in known:
            found[len(known) - 1] = a, b, c
            known.add(key)
    return found[: len(known) - 1].copy()


@numba.njit(cache=True)
def _carry(vertices: Floats, moved: Floats, index: Ints, owner: Ints, edges: Ints) -> Floats:
    few, carried = vertices[index], np.empty((len(vertices), moved.shape[1]))
    turns = _turns(few, moved, edges)
    for i in range(len(vertices)):
        turn = turns[owner[i]]
        for p in range(moved.shape[1]):
            carried[i, p] = moved[owner[i], p]
            for q in range(3):
                carried[i, p] += turn[p, q] * (vertices[i, q] - few[owner[i], q])
    return carried


@numba.njit(cache=True)
def _turns(vertices: Floats, moved: Floats, edges: Ints) -> Floats:
    """(k, d, 3): the map that takes the way to each neighbour of a vertex (k, 3) to the same way in moved (k, d)."""
    spread, across = _spread(vertices, moved, edges)
    turns, inverse = np.zeros_like(across), np.empty((3, 3))
    for k in range(len(spread)):
        own = spread[k]
        least = FLATTEST * (own[0, 0] + own[1, 1] + own[2, 2])
        for p in range(3):
            own[p, p] += least
        for p in range(3):
            m, n = (p + 1) % 3, (p + 2) % 3
            for q in range(3):
                s, t = (q + 1) % 3, (q + 2) % 3
                inverse[q, p] = own[m, s] * own[n, t] - own[m, t] * own[n, s]
        scale = own[0, 0] * inverse[0, 0] + own[0, 1] * inverse[1, 0] + own[0, 2] * inverse[2, 0]
        for p in range(across.shape[1]):
            for q in range(3):
                for r in range(3):
                    turns[k, p, q] += across[k, p, r] * inverse[r, q] / scale
    return turns


@numba.njit(cache=True)
def _spread(vertices: Floats, moved: Floats, edges: Ints) -> tuple[Floats, Floats]:
    """Sums over the ways to all neighbours of a vertex: way × way (k, 3, 3) and moved way × way (k, d, 3)."""
    spread, across = np.zeros((len(vertices), 3, 3)), np.zeros((len(vertices), moved.shape[1], 3))
    for e in range(len(edges)):
        a, b = edges[e, 0], edges[e, 1]
        for q in range(3):
            way = vertices[b, q] - vertices[a, q]
            for p in range(3):
                product = (vertices[b, p] - vertices[a, p]) * way
                spread[a, p, q] += product
                spread[b, p, q] += product
            for p in range(moved.shape[1]):
                product = (moved[b, p] - moved[a, p]) * way
                across[a, p, q] += product
                across[b, p, q] += product
    return spread, across
