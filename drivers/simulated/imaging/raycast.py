"""Where rays first meet a triangle mesh, by open3d's ray casting."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from restore.runtime.native import load_open3d
from restore.scan import Floats, Ints

Vectors = NDArray[np.floating[Any]]
"""Single precision will do wherever the answer need not be exact."""


class RayCaster:
    """Ray caster for a fixed mesh: where rays first meet it.

    vertices: (n, 3) mm.
    faces: (m, 3).
    Raises ValueError when a face names a missing vertex (open3d would crash), LibraryMissing when open3d cannot be
    loaded.
    """

    def __init__(self, vertices: Floats, faces: Ints) -> None:
        if faces.size == 0 or faces.min() < 0 or faces.max() >= len(vertices):
            raise ValueError(f"faces must name vertices 0 to {len(vertices) - 1}")
        o3d = load_open3d()
        self._tensor = o3d.core.Tensor
        self._scene = o3d.t.geometry.RaycastingScene()
        self._scene.add_triangles(self._tensor(vertices.astype(np.float32)), self._tensor(faces.astype(np.uint32)))

    def first_hit(self, origin: Floats, directions: Vectors) -> tuple[Ints, NDArray[np.float32]]:
        """Return face and distance of the first hit along rays.

        origin: (3,) mm, of all rays.
        directions: (…, 3).
        Returns (…) int64 face, −1 where a ray meets nothing, and (…) float32 distance in lengths of the direction, inf
        there.
        """
        return self.first_hits(np.broadcast_to(origin, directions.shape), directions)

    def first_hits(self, origins: Vectors, directions: Vectors) -> tuple[Ints, NDArray[np.float32]]:
        """The same along rays that each have an origin (…, 3) mm of their own."""
        rays = np.empty((*directions.shape[:-1], 6), np.float32)
        rays[..., :3], rays[..., 3:] = origins, directions
        hit = self._scene.cast_rays(self._tensor(rays))
        # open3d's mark for a ray that meets nothing, 0xFFFFFFFF, is −1 as a signed number.
        return hit["primitive_ids"].numpy().view(np.int32).astype(np.int64), hit["t_hit"].numpy()
