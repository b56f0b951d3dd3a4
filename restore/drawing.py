"""Public functions for pictures of meshes.

Triangles as pixels, normals, and the strain of a flat page.
"""

from restore.mesh.measures import vertex_normals
from restore.mesh.raster import rasterise
from restore.mesh.strain import average_at_vertices, face_strain

__all__ = ["average_at_vertices", "face_strain", "rasterise", "vertex_normals"]
