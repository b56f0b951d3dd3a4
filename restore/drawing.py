"""Public functions for pictures of meshes: triangles, normals, values at vertices."""

from restore.mesh.measures import vertex_normals
from restore.mesh.raster import rasterise
from restore.mesh.strain import average_at_vertices

__all__ = ["average_at_vertices", "rasterise", "vertex_normals"]
