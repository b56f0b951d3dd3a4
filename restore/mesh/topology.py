"""Edges and faces of a mesh, from the faces alone.

Each table is made once, when it is first read.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from restore.mesh.adjacency import Sides, inner_vertices, piece_of_faces, sides_of
from restore.scan import Ints, Mask


@dataclass(frozen=True, eq=False)
class Topology:
    """The faces (m, 3) of a mesh, and what follows from them.

    >>> square = Topology(np.array([[0, 1, 2], [0, 2, 3]]))
    >>> square.edges.tolist(), square.border.tolist()
    ([[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]], [0, 1, 2, 3])
    """

    faces: Ints

    @cached_property
    def sides(self) -> Sides:
        """The sides of the faces, grouped by edge."""
        return sides_of(self.faces)

    @property
    def edges(self) -> Ints:
        """Return the edges (e, 2), each once, in ascending order.

        The smaller vertex comes first.
        """
        return self.sides.edges

    @cached_property
    def face_counts(self) -> Ints:
        """Return how many faces meet in each edge, (e,)."""
        return np.diff(self.sides.first)

    @cached_property
    def border(self) -> Ints:
        """Return the ends of edges of one face only, (b,), ascending."""
        return np.unique(self.edges[self.face_counts == 1])

    @cached_property
    def inner(self) -> Mask:
        """Return whether each vertex has edges, and all of them two faces.

        Returns (n,), up to the last vertex that a face uses.
        """
        return inner_vertices(self.sides, int(self.faces.max(initial=-1)) + 1)

    @cached_property
    def pieces(self) -> Ints:
        """Return the connected piece (m,) of each face.

        Faces that have a vertex in common are of one piece.
        """
        return piece_of_faces(self.faces)

    @cached_property
    def is_disc(self) -> bool:
        """Return whether a connected mesh has one border and no handle.

        V − E + F = 1, and no border vertex is met twice.
        """
        ends = np.bincount(self.edges[self.face_counts == 1].ravel())
        simple = bool(self.face_counts.max() <= 2 and (ends[self.border] == 2).all())
        return simple and len(np.unique(self.faces)) - len(self.edges) + len(self.faces) == 1
