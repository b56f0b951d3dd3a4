"""The sticks of a mesh: which particles are joined, and how far apart they belong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from restore.errors import BadInput
from restore.flatten.adjacency import order_of_pairs
from restore.scan import Floats, Ints
from restore.strain import between

GOLDEN = (5.0**0.5 - 1.0) / 2.0
BLOCK = 8192  # pairs of a quarter of a megabyte
TINY = 1e-9  # of the mean edge: shorter edges would divide by zero


@dataclass(frozen=True, eq=False)
class Network:
    """Sticks and hinges.

    faces          (m, 3)
    edges, lengths (e, 2), (e,) mm: sticks, each edge of the mesh once.
    hinges, spans  (b, 2), (b,) mm: the two corners that face each other over every inner edge, and how far apart they
                   are when the hinge lies flat. Keeping them there is the bending resistance.
    """

    faces: Ints
    edges: Ints
    lengths: Floats
    hinges: Ints
    spans: Floats


@dataclass(frozen=True, eq=False)
class Piece:
    """A connected part of a mesh: its vertices (k,) in the whole, and its own faces and network."""

    vertices: Ints
    faces: Ints
    network: Network


def edges_of(faces: Ints) -> Ints:
    """(e, 2): each edge of faces (m, 3) once, the smaller vertex first, in ascending order."""
    return _edges_and_apexes(faces)[0]


def make_network(vertices: Floats, faces: Ints, lengths: Floats | None = None) -> Network:
    """Join vertices (n, 3) mm along the edges of faces (m, 3); lengths (e,) as in `edges_of`, or measured here.

    Raises BadInput when the lengths are not one for each edge.
    """
    edges, inner, hinges = _edges_and_apexes(faces)
    if lengths is None:
        lengths = straight_lengths(vertices, edges)
    if lengths.shape != (len(edges),) or not (lengths >= 0).all() or not 0 < lengths.sum() < np.inf:
        raise BadInput(f"{len(edges)} edges need {len(edges)} finite lengths", "give them in the order of `edges_of`")
    lengths = np.maximum(lengths, TINY * lengths.mean())
    return Network(faces, edges, lengths, hinges, _spans(edges, lengths, inner, hinges))


def straight_lengths(vertices: Floats, edges: Ints) -> Floats:
    """(e,) distances of the ends of edges (e, 2) among vertices (n, 3) mm."""
    return np.asarray(np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1))


def _edges_and_apexes(faces: Ints) -> tuple[Ints, Ints, Ints]:
    """Edges (e, 2); which of them are inner (b,); the two corners facing each inner edge (b, 2)."""
    half, side, first = half_edges(faces)
    inner = np.flatnonzero(np.diff(first) == 2)  # an edge of three faces is a flaw of the mesh and no hinge
    edges, pair = half[first[:-1]], first[inner]
    ends = edges[inner].sum(axis=1)
    return edges, inner, np.stack([faces[side[k] // 3].sum(axis=1) - ends for k in (pair, pair + 1)], axis=1)


def half_edges(faces: Ints) -> tuple[Ints, Ints, Ints]:
    """The sides (h, 2) of faces (m, 3), the smaller vertex first, in ascending order; which they are (h,); where each
    edge begins among them, and the end (e + 1,).

    Side 3·f + k runs from corner k of face f to the next.
    """
    ends = np.roll(faces, -1, axis=1)
    low, high = np.minimum(faces, ends).ravel(), np.maximum(faces, ends).ravel()
    order = order_of_pairs(low, high, int(faces.max(initial=-1)) + 1)
    order = order[low[order] < high[order]]  # a face that names a vertex twice has a side that is none
    low, high = low[order], high[order]
    new = np.ones(len(low), bool)
    new[1:] = (low[1:] != low[:-1]) | (high[1:] != high[:-1])
    return np.stack([low, high], axis=1), order, np.append(np.flatnonzero(new), len(low))


def _spans(edges: Ints, lengths: Floats, inner: Ints, hinges: Ints) -> Floats:
    """Distance of the two corners when both triangles are unfolded into one plane, from the five edge lengths."""
    base = lengths[inner]
    start, end = edges[inner].T

    def corner(apex: Ints) -> tuple[Floats, Floats]:
        near, far = (between(side, apex, edges, lengths) for side in (start, end))
        # Never farther along than the side is long, or a sliver would throw its corner off the page.
        along = np.clip((near**2 - far**2 + base**2) / (2 * base), -near, near)
        return along, np.sqrt(np.maximum(near**2 - along**2, 0.0))

    (x0, y0), (x1, y1) = corner(hinges[:, 0]), corner(hinges[:, 1])
    return np.hypot(x0 - x1, y0 + y1)


def spread(pairs: Ints, lengths: Floats) -> tuple[Ints, Floats]:
    """The same pairs (k, 2) and lengths (k,) in an order in which neighbours in the list are none on the sheet.

    Going over one pair then does not wait for the one before it, and the processor takes several at a time. Those of a
    block stay together, as it fits into the processor's cache.
    """
    whole = len(pairs) // BLOCK * BLOCK
    blocks = np.arange(0, whole, BLOCK)[:, None] + _strides(BLOCK)
    order = np.concatenate([blocks.ravel(), whole + _strides(len(pairs) - whole)])
    return pairs[order], lengths[order]


@lru_cache(maxsize=16)
def _strides(count: int) -> Ints:
    """0 to count − 1 in steps of about the golden section, which come back to the same place last."""
    stride = max(round(GOLDEN * count), 1)
    while np.gcd(stride, max(count, 1)) != 1:
        stride += 1
    return np.arange(count) * stride % max(count, 1)


def pieces(network: Network) -> Iterator[Piece]:
    """The connected parts, largest first. Vertices without a face belong to none."""
    count = network.faces.max() + 1
    graph = coo_matrix((np.ones(len(network.edges)), network.edges.T), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    sizes = np.bincount(label[network.faces[:, 0]], minlength=label.max() + 1)
    for part in np.argsort(-sizes, kind="stable"):
        if sizes[part] == 0:
            break
        if sizes[part] == len(network.faces) and (label == part).all():
            yield Piece(np.arange(count), network.faces, network)
            break
        yield _piece(network, label == part)


def _piece(network: Network, member: np.ndarray) -> Piece:
    index = np.cumsum(member) - 1
    faces = index[network.faces[member[network.faces[:, 0]]]]
    sticks = member[network.edges[:, 0]]
    bends = member[network.hinges[:, 0]]
    part = Network(
        faces, index[network.edges[sticks]], network.lengths[sticks], index[network.hinges[bends]], network.spans[bends]
    )
    return Piece(np.flatnonzero(member), faces, part)
