"""A sheet of many points, seen as one of few: cells of neighbours, and the mesh of their middles.

What a sheet looks like from afar is settled by few points, in a hundredth of the time. The cells are grown from their
middles over the mesh, so that a fold or a tear divides them as it divides the sheet; wherever three of them meet, their
middles make a face.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from restore.flatten.adjacency import Adjacency, adjacency
from restore.flatten.network import Network, make_network
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
        few = vertices[self.index]
        turns = _turns(few, moved, self.network.edges)[self.owner]
        return np.asarray(moved[self.owner] + np.einsum("nij,nj->ni", turns, vertices - few[self.owner]))


def coarsen(vertices: Floats, network: Network, most: int) -> Coarse | None:
    """The sheet by no more than about `most` points; None where its cells make no mesh that covers it."""
    count = len(vertices)
    hops = max(round(np.sqrt(count / most)) - 1, LEAST_HOPS)
    around = adjacency(network.edges.ravel(), network.edges[:, ::-1].ravel(), count)
    index, owner = _cells(around, hops)
    corners = owner[network.faces]
    a, b, c = corners.T
    faces = corners[(a != b) & (b != c) & (c != a)]
    low, middle, high = np.sort(faces, axis=1).T
    _, first = np.unique((low * len(index) + middle) * len(index) + high, return_index=True)
    faces = faces[np.sort(first)]
    if len(faces) == 0 or len(np.unique(faces)) < len(index):
        return None
    return Coarse(index, owner, make_network(vertices[index], faces))


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


def _turns(vertices: Floats, moved: Floats, edges: Ints) -> Floats:
    """(k, d, 3): the map that takes the way to each neighbour of a vertex (k, 3) to the same way in moved (k, d)."""
    spread, across = _spread(vertices, moved, edges)
    spread += FLATTEST * np.trace(spread, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    return np.asarray(across @ np.linalg.inv(spread))


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
