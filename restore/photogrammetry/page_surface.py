"""What the surface of a page is to those who look for it in photographs."""

from __future__ import annotations

from typing import Protocol, Self

from restore.photogrammetry.align import Similarity
from restore.photogrammetry.surface import Surface
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
        """(n, 3) mm at places (n, 2) mm."""
        ...

    def normals(self, places: Floats) -> Floats:
        """(n, 3) unit normals at places (n, 2) mm."""
        ...

    def frames(self, places: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Points (n, 3) mm, tangents (n, 2, 3), normals (n, 3) and curvatures (n, 3) 1/mm at places (n, 2) mm."""
        ...

    def feet(self, points: Floats, start: Floats) -> Floats:
        """(n, 2) mm: places next to points (n, 3) mm, sought from places (n, 2)."""
        ...

    def moved(self, similarity: Similarity) -> Self:
        """The surface in another frame; its places stay as they are."""
        ...

    def uncreased(self, places: Floats, half: float) -> Mask:
        """(n,) True where a square of half a side, mm, about places (n, 2) holds no crease."""
        ...

    def creased(self, places: Floats, faces: Ints) -> Floats:
        """(n, 3) mm: vertices at places (n, 2) mm of a mesh of faces (m, 3), those beside a crease moved onto it."""
        ...
