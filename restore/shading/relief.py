"""Position and normal in space of every pixel of the flat page."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from restore.mesh.measures import vertex_normals
from restore.mesh.pose import pose_on_table
from restore.numerics.limits import SINGLE_TINY
from restore.page import FlatMesh
from restore.range_image.facets.normals import Field, facet_normals
from restore.range_image.facets.sheet import Sheet
from restore.scan import Floats, Ints, Mask, SurfaceMesh
from restore.texture.page import page_map


@dataclass(frozen=True, eq=False)
class Relief:
    """The warped page over the flat one, at `dpi` pixels to the inch, in a frame whose z is the page's mean normal.

    points   (h, w, 3) mm, NaN off the page.
    normals  (h, w, 3) of unit length on the printed side, NaN off the page.
    vertices (n, 3) mm and faces (m, 3): the mesh they came from, in the same frame.
    axes     (3, 3) rows x, y, z of the frame, and origin (3,) mm, both in the scanner's.
    """

    points: Field
    normals: Field
    dpi: float
    vertices: Floats
    faces: Ints
    axes: Floats
    origin: Floats

    @property
    def inside(self) -> Mask:
        """(h, w) True on the page."""
        return np.asarray(np.isfinite(self.points[..., 2]))


def relief_of(surface: Sheet | SurfaceMesh, fine: FlatMesh, dpi: float) -> Relief:
    """Relief of a prepared surface at `dpi` pixels of the flat page to the inch.

    On a range grid every sample has a facet of its own, so a crease is sharp; a mesh has the normals of its vertices.
    """
    posed = pose_on_table(fine.vertices, fine.faces)
    vertices, axes = posed.positions, posed.axes
    if isinstance(surface, Sheet):
        rows, cols = surface.rays.grid(fine.vertices)
        over = page_map(fine.flat, fine.faces, np.column_stack([vertices, cols, rows]), dpi)
        # Nearest, not in between: facets that meet at a crease must not be mixed.
        facets, at = facet_normals(surface), np.ascontiguousarray(over[..., 3:])
        normals = cv2.remap(facets, at, None, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE) @ axes.T.astype("f")
    else:
        own = vertex_normals(fine.vertices, fine.faces)
        over = page_map(fine.flat, fine.faces, np.column_stack([vertices, own @ axes.T]), dpi)
        normals = over[..., 3:] / np.maximum(np.linalg.norm(over[..., 3:], axis=2, keepdims=True), SINGLE_TINY)
    normals[np.isnan(over[..., 0])] = np.nan
    return Relief(over[..., :3], normals, dpi, vertices, fine.faces, axes, posed.origin)
