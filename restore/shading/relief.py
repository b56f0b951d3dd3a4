"""Position and normal in space of every pixel of the flat page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from restore.mesh.pose import pose_on_table
from restore.page import FlatMesh
from restore.range_image.facets.normals import Field
from restore.scan import Floats, Ints, Mask
from restore.texture.page import page_map

NormalsOn = Callable[[FlatMesh, float, Floats], Field]
"""Flat page, its resolution, axes of a frame → unit normals in that frame.

(h, w, 3), NaN off the page.
"""


@dataclass(frozen=True, eq=False)
class Relief:
    """Warped page over the flat one, at `dpi` pixels to the inch.

    Its frame has the page's mean normal as z.
    points: (h, w, 3) mm, NaN off the page.
    normals: (h, w, 3), of unit length on the printed side, NaN off the page.
    vertices, faces: (n, 3) mm and (m, 3), the mesh they came from, in the same frame.
    axes: (3, 3), rows x, y, z of the frame, and origin (3,) mm, both in the scanner's.
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
        """Return where the page is, (h, w) bool."""
        return np.asarray(np.isfinite(self.points[..., 2]))


def relief_of(fine: FlatMesh, normals_on: NormalsOn, dpi: float) -> Relief:
    """Return the relief of a flat page at `dpi` pixels to the inch.

    normals_on: as `Prepared` has it.
    """
    posed = pose_on_table(fine.vertices, fine.faces)
    points = page_map(fine.flat, fine.faces, posed.positions, dpi)
    normals = normals_on(fine, dpi, posed.axes)
    return Relief(points, normals, dpi, posed.positions, fine.faces, posed.axes, posed.origin)
