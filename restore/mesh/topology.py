"""Which faces of a mesh meet in which edges, from the faces alone: each table is made once, when it is first read."""

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
        """(e, 2): each edge once, the smaller vertex first, in ascending order."""
        return self.sides.edges

    @cached_property
    def face_counts(self) -> Ints:
        """(e,) how many faces meet in each edge."""
        return np.diff(self.sides.first)

    @cached_property
    def border(self) -> Ints:
        """(b,) the ends of edges of one face only, in ascending order."""
        return np.unique(self.edges[self.face_counts == 1])

    @cached_property
    def inner(self) -> Mask:
        """(n,) whether a vertex, up to the last that a face uses, has edges, and all of them two faces."""
        return inner_vertices(self.sides, int(self.faces.max(initial=-1)) + 1)

    @cached_property
    def pieces(self) -> Ints:
        """(m,) the connected piece of each face; faces that share a vertex are of one."""
        return piece_of_faces(self.faces)

    @cached_property
    def is_disc(self) -> bool:
        """Whether a connected mesh has one border and no handle: V − E + F = 1, no border vertex met twice."""
        ends = np.bincount(self.edges[self.face_counts == 1].ravel())
        simple = bool(self.face_counts.max() <= 2 and (ends[self.border] == 2).all())
        return simple and len(np.unique(self.faces)) - len(self.edges) + len(self.faces) == 1
