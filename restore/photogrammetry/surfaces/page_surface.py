"""What the surface of a page is to those who look for it in photographs."""

from __future__ import annotations

from typing import Protocol, Self

from restore.photogrammetry.cameras.align import Similarity
from restore.photogrammetry.surfaces.lattice import Cloud
from restore.photogrammetry.surfaces.surface import Surface
from restore.report import SurfaceReport
from restore.scan import Floats, Ints, Mask


class PageSurface(Protocol):
    """Points in space over places (n, 2) mm; smooth, or with creases."""

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """The rectangle from low (2,) to high (2,) mm of its places."""
        ...

    @property
    def smooth(self) -> Surface:
        """The smooth surface whose places are those of this one."""
        ...

    def points(self, places: Floats) -> Floats:
        """Return points (n, 3) mm at places (n, 2) mm."""
        ...

    def normals(self, places: Floats) -> Floats:
        """Return unit normals (n, 3) at places (n, 2) mm."""
        ...

    def frames(self, places: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return points, tangents, normals and curvatures at places (n, 2) mm.

        They are (n, 3) mm, (n, 2, 3), (n, 3) and (n, 3) 1/mm.
        """
        ...

    def feet(self, points: Floats, start: Floats) -> Floats:
        """Return places (n, 2) mm next to points (n, 3) mm.

        start: (n, 2), places to search from.
        """
        ...

    def moved(self, similarity: Similarity) -> Self:
        """The surface in another frame; its places stay as they are."""
        ...

    def uncreased(self, places: Floats, half: float) -> Mask:
        """Return whether a square about each place holds no crease.

        half: half a side, mm. places: (n, 2) mm. Returns (n,) bool.
        """
        ...

    def creased(self, places: Floats, faces: Ints) -> Floats:
        """Return mesh vertices (n, 3) mm, those near a crease moved onto it.

        places: (n, 2) mm.
        faces: (m, 3).
        """
        ...

    @property
    def piece_count(self) -> int:
        """How many smooth pieces it has, as far as they are known."""
        ...

    def flat_corners(self, vertices: Floats, faces: Ints, places: Floats) -> Floats | None:
        """Return the corners (m, 3, 2) mm of a creased mesh's faces on the flat page.

        None where it has no flat page of its own.
        vertices: (n, 3) mm, at places (n, 2) mm.
        faces: (m, 3).
        """
        ...

    def gutter_widths(self) -> Floats | None:
        """Return the lengths (rows,) mm over its crease; None where none parts it in two."""
        ...

    def described(self, stiffness: float) -> SurfaceReport:
        """Return what a report says of it.

        stiffness: mm⁴, where it is smooth.
        """
        ...

    def edge_counts(self, places: Floats, measured: Mask, spacing: float) -> Ints:
        """Return how often points of the page's edge count for it, (n,).

        places: (n, 2) mm, a spacing apart.
        measured: (n,).
        """
        ...

    def through(self, cloud: Cloud, stiffness: float) -> Self:
        """Return the surface through points near it.

        stiffness: mm⁴, where it is smooth.
        """
        ...
