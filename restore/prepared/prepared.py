"""The flat page as meshes, and its rotation to an upright picture."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

from restore.mesh.adjacency import border_of
from restore.mesh.measures import signed_areas
from restore.outline.rectangle import squaring_rotation
from restore.page import FlatMesh
from restore.scan import Floats

Clock = Callable[[str], AbstractContextManager[None]]


@dataclass(frozen=True, eq=False)
class Unrolled:
    """The flat page as meshes.

    coarse    the mesh of the requested number of points, with flat positions interpolated from the fine mesh.
    fine      the mesh that maps the picture to the page.
    nodes     (k, 2) grid positions of the vertices of the fine mesh; empty for a mesh without a grid.
    distance  depth between the coarse mesh and the surface, mm; empty for a mesh without a grid.
    """

    coarse: FlatMesh
    fine: FlatMesh
    nodes: Floats
    distance: dict[str, float]


def square_to_picture(flat: FlatMesh) -> FlatMesh:
    """The flat mesh rotated about its centroid so that the sides of a rectangular page are parallel to the axes."""
    turn, centre = squaring(flat)
    return replace(flat, flat=(flat.flat - centre) @ turn.T + centre)


def squaring(flat: FlatMesh) -> tuple[Floats, Floats]:
    """The rotation (2, 2) that makes the sides of a rectangular page parallel to the axes, and its centre (2,) mm."""
    area = float(signed_areas(flat.flat, flat.faces).sum())
    return squaring_rotation(flat.flat[border_of(flat.faces)], area), flat.flat.mean(axis=0)
