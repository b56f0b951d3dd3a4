"""Whether a mesh is one: refuse what no later step can use, with the reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from restore.errors import BadInput, NotEnoughSurface
from restore.mesh.measures import surface_area
from restore.scan import SurfaceMesh


def checked(mesh: SurfaceMesh) -> SurfaceMesh:
    """The mesh as it is declared, without faces that name a vertex twice, which have no edge of their own and no area.

    Raises unless it has faces with an area, finite vertices, indices in range and whole texture coordinates.
    """
    if len(mesh.faces) == 0:
        raise NotEnoughSurface("the mesh has no faces", "scan the page again or give a mesh with triangles")
    mesh = _as_declared(mesh)
    if not np.isfinite(mesh.vertices).all():
        raise BadInput("the mesh has vertices that are not finite", "remove them and try again")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise BadInput("the mesh has faces that name vertices it does not have", "the file is damaged: export it again")
    if mesh.texcoords is not None and mesh.texcoords.shape != (len(mesh.vertices), 2):
        raise BadInput("the mesh has no texture coordinate for some vertices", "the file is damaged: export it again")
    if surface_area(mesh.vertices, mesh.faces) == 0.0:
        raise NotEnoughSurface("the faces of the mesh have no area", "scan the page again or give a mesh of a surface")
    a, b, c = mesh.faces.T
    proper = (a != b) & (b != c) & (c != a)
    return mesh if proper.all() else replace(mesh, faces=mesh.faces[proper])


def _as_declared(mesh: SurfaceMesh) -> SurfaceMesh:
    """The mesh with its numbers in the types that it declares. Raises BadInput for what is no mesh of triangles."""
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    if vertices.shape[1:] != (3,) or faces.shape[1:] != (3,):
        shapes = f"vertices {vertices.shape} and faces {faces.shape}"
        raise BadInput(f"{shapes} are no triangles in space", "give (n, 3) mm and (m, 3) numbers of vertices")
    if vertices.dtype.kind not in "fiu" or faces.dtype.kind not in "iu":
        kinds = f"vertices of {vertices.dtype} and faces of {faces.dtype}"
        raise BadInput(f"{kinds} are no triangles in space", "give millimetres and whole numbers of vertices")
    vertices, faces = vertices.astype(np.float64, copy=False), faces.astype(np.int64, copy=False)
    declared = vertices is mesh.vertices and faces is mesh.faces
    return mesh if declared else replace(mesh, vertices=vertices, faces=faces)
