"""The edges of a mesh: which particles are joined, and how far apart they belong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from restore.errors import BadInput
from restore.mesh.adjacency import Sides, components
from restore.mesh.measures import lengths_between, straight_lengths
from restore.mesh.topology import Topology
from restore.numerics.limits import SINGLE_PRECISION, TINY, overflows_silently
from restore.scan import Floats, Ints, Mask


@dataclass(frozen=True, eq=False)
class Network:
    """The faces of a mesh, and the lengths (e,) mm at rest of its edges, each edge once."""

    topology: Topology
    lengths: Floats

    @property
    def faces(self) -> Ints:
        """Return the faces (m, 3)."""
        return self.topology.faces

    @property
    def sides(self) -> Sides:
        """The sides of the faces, grouped by edge."""
        return self.topology.sides

    @property
    def edges(self) -> Ints:
        """Return the edges (e, 2), the smaller vertex first."""
        return self.topology.edges

    @cached_property
    @overflows_silently
    def areas(self) -> Floats:
        """Return the areas (m,) mm² of faces at rest, 0 for one without two different corners."""
        own = self.sides.edge.reshape(-1, 3).T
        a, b, c = self.lengths[own]
        half = 0.5 * (a + b + c)
        areas = np.sqrt(np.maximum(half * (half - a) * (half - b) * (half - c), 0.0))  # Heron
        return np.where(own.min(axis=0) >= 0, areas, 0.0)


@dataclass(frozen=True, eq=False)
class Piece:
    """Connected part of a mesh.

    vertices: (k,), in the whole mesh. It has its own faces and network.
    """

    vertices: Ints
    faces: Ints
    network: Network


def make_network(vertices: Floats, topology: Topology, lengths: Floats | None = None) -> Network:
    """Join vertices along the edges of a topology.

    vertices: (n, 3) mm.
    lengths: (e,) mm in the order of the edges, or None to measure them.
    Raises BadInput when the lengths are not one positive number for each edge.
    """
    if lengths is None:
        lengths = straight_lengths(vertices, topology.edges)
    count, lengths = len(topology.edges), np.asarray(lengths)
    fit = lengths.shape == (count,) and lengths.dtype.kind in "fiu" and lengths.min(initial=0.0) >= 0.0
    lengths = lengths.astype(np.float64, copy=False) if fit else lengths  # of any precision; kernels take one
    mean = float(lengths.mean(dtype=float)) if fit else 0.0
    if not TINY < mean * mean * mean * mean < 1.0 / TINY:  # as they are multiplied for the areas of faces
        raise BadInput(
            f"{count} edges need {count} finite lengths", "give them in mm, in the order of `Topology.edges`"
        )
    return Network(topology, np.maximum(lengths, SINGLE_PRECISION * mean))  # to divide by


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
    topology = Topology(faces)
    start, end = vertices[topology.edges].T
    lengths = lengths_between(start, end, network.edges, network.lengths)
    return Piece(vertices, faces, make_network(np.empty((0, 3)), topology, lengths))
