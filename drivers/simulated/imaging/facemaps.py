"""For each face of a scene: its plane in space and its map to the page."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivers.simulated.imaging.raycast import Vectors
from drivers.simulated.scene.scene import Scene
from restore.scan import Floats, Ints


@dataclass(frozen=True, eq=False)
class FaceMaps:
    """Planes and page maps of all faces.

    Coefficients come first: to pick one for many faces is then quickest.
    normals: (3, m), unit normals on the printed side.
    offsets: (m,) mm: the plane is normal · point = offset.
    to_page: (2, 4, m): a point (x, y, z) mm of the face lies at to_page · (x, y, z, 1) mm on the page.
    """

    normals: Floats
    offsets: Floats
    to_page: Floats

    @classmethod
    def of(cls, scene: Scene) -> FaceMaps:
        """The maps of a scene's faces."""
        space, page = scene.vertices[scene.faces], scene.page_uv[scene.faces]
        edges, page_edges = space[:, 1:] - space[:, :1], page[:, 1:] - page[:, :1]  # (m, 2, 3), (m, 2, 2)
        normals = np.cross(edges[:, 0], edges[:, 1])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        dual = np.linalg.inv(edges @ edges.transpose(0, 2, 1)) @ edges  # least-squares inverse of the edges
        linear = page_edges.transpose(0, 2, 1) @ dual
        origin = page[:, 0] - np.einsum("mij,mj->mi", linear, space[:, 0])
        to_page = np.concatenate([linear, origin[..., None]], axis=2)
        offsets = np.einsum("mi,mi->m", normals, space[:, 0])
        return cls(np.ascontiguousarray(normals.T), offsets, np.ascontiguousarray(to_page.transpose(1, 2, 0)))

    def meet(self, face: Ints, directions: Floats) -> Floats:
        """Return where rays from the lens centre meet planes, (n, 3) mm.

        face: (n,).
        directions: (n, 3).
        """
        return directions * (self.offsets[face] / self.along_normal(face, directions))[:, None]

    def along_normal(self, face: Ints, vectors: Floats) -> Floats:
        """Return components (n,) of vectors (n, 3) along face normals.

        face: (n,).
        """
        x, y, z = self.normals
        return np.asarray(x[face] * vectors[:, 0] + y[face] * vectors[:, 1] + z[face] * vectors[:, 2])

    def facing(self, face: Ints, points: Floats) -> Floats:
        """Return unit normals (n, 3) of faces on the side that the lens sees.

        face: (n,).
        points: (n, 3) mm.
        """
        normals = np.stack([axis[face] for axis in self.normals], axis=1)
        return np.asarray(normals * -np.sign(np.einsum("ij,ij->i", normals, points))[:, None])

    def page(self, face: Ints, points: Vectors) -> Floats:
        """Return the page positions (n, 2) mm of points on faces (n,).

        points: (n, 3) mm.
        """
        x, y, z = points.T
        return np.stack([a[face] * x + b[face] * y + c[face] * z + d[face] for a, b, c, d in self.to_page], axis=1)
