"""`.stl`: triangles without colour, text or binary, each with corners of its own."""

from __future__ import annotations

from pathlib import Path

from restore.formats.mesh import checked_mesh
from restore.formats.source import read_bytes
from restore.formats.trimesh_parser import parse_mesh
from restore.scan import Bytes, SurfaceMesh


def read_stl(path: Path, texture: Bytes | None = None) -> SurfaceMesh:
    """Read the triangles and join corners at the same place to one vertex; `texture` (h, w, 3). Raises BadInput."""
    arrays = parse_mesh(path, read_bytes(path), "stl")
    mesh = checked_mesh(path, arrays.vertices, arrays.faces)  # checked before the vertices are compared
    from trimesh.grouping import unique_rows

    unique, inverse = unique_rows(mesh.vertices)
    return checked_mesh(path, mesh.vertices[unique], inverse[mesh.faces], texture=texture)
