"""The edges of a mesh: which particles are joined, and how far apart they belong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from restore.errors import BadInput
from restore.mesh.adjacency import Sides, components, sides_of
from restore.mesh.measures import lengths_between, straight_lengths
from restore.numerics.limits import SINGLE_PRECISION, TINY
from restore.scan import Floats, Ints, Mask


@dataclass(frozen=True, eq=False)
class Network:
    """faces (m, 3), their sides, and the lengths (e,) mm of the edges, each edge of the mesh once."""

    faces: Ints
    sides: Sides
    lengths: Floats

    @property
    def edges(self) -> Ints:
        """(e, 2) edges, the smaller vertex first."""
        return self.sides.edges


@dataclass(frozen=True, eq=False)
class Piece:
    """A connected part of a mesh: its vertices (k,) in the whole, and its own faces and network."""

    vertices: Ints
    faces: Ints
    network: Network


def edges_of(faces: Ints) -> Ints:
    """(e, 2): each edge of faces (m, 3) once, the smaller vertex first, in ascending order.

    >>> edges_of(np.array([[0, 1, 2], [0, 2, 3]])).tolist()
    [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]
    """
    return sides_of(faces).edges


def make_network(vertices: Floats, faces: Ints, lengths: Floats | None = None, sides: Sides | None = None) -> Network:
    """Join vertices (n, 3) mm along the edges of faces (m, 3); lengths (e,) as in `edges_of`, or measured here.

    sides are those of the faces when they are known already.
    Raises BadInput when the lengths are not one positive number for each edge.
    """
    sides = sides or sides_of(faces)
    if lengths is None:
        lengths = straight_lengths(vertices, sides.edges)
    count, lengths = len(sides.edges), np.asarray(lengths)
    fit = lengths.shape == (count,) and lengths.dtype.kind in "fiu" and lengths.min(initial=0.0) >= 0.0
    lengths = lengths.astype(np.float64, copy=False) if fit else lengths  # of any precision; kernels take one
    mean = float(lengths.mean(dtype=float)) if fit else 0.0
    if not TINY < mean * mean * mean * mean < 1.0 / TINY:  # as they are multiplied for the areas of faces
        raise BadInput(f"{count} edges need {count} finite lengths", "give them in mm, in the order of `edges_of`")
    return Network(faces, sides, np.maximum(lengths, SINGLE_PRECISION * mean))  # to divide by


def pieces(network: Network) -> Iterator[Piece]:
    """The connected parts, largest first. Vertices without a face belong to none."""
    count = network.faces.max() + 1
    label = components(network.edges, count)
    if not label.any():
        yield Piece(np.arange(count), network.faces, network)
        return
    sizes = np.bincount(label[network.faces[:, 0]], minlength=label.max() + 1)
    for part in np.argsort(-sizes, kind="stable"):
        if sizes[part] == 0:
            break
        yield part_of(network, label[network.faces[:, 0]] == part)


def part_of(network: Network, member: Mask) -> Piece:
    """What some of the faces of a network, member (m,), are by themselves."""
    chosen = network.faces[member]
    inside = np.zeros(chosen.max() + 1, bool)
    inside[chosen] = True
    vertices = np.flatnonzero(inside)
    faces = (np.cumsum(inside) - 1)[chosen]
    sides = sides_of(faces)
    start, end = vertices[sides.edges].T
    lengths = lengths_between(start, end, network.edges, network.lengths)
    return Piece(vertices, faces, make_network(np.empty((0, 3)), faces, lengths, sides))
