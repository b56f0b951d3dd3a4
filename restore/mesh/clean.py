"""Clean a mesh that has no range grid: drop debris, close pinholes, smooth noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from restore.errors import NotEnoughSurface
from restore.mesh.adjacency import components
from restore.mesh.decimate import decimate, patch_and_smooth
from restore.mesh.network import make_network, pieces
from restore.mesh.triangulate import MIN_PIECE_SHARE, compact
from restore.mesh.validate import ValidMesh
from restore.scan import Ints, Mask, SurfaceMesh

RAW_RATIO = 5  # times the points requested: a denser mesh is a scanner's own, a coarser one was decimated before


def clean(mesh: SurfaceMesh, points: int) -> SurfaceMesh:
    """The mesh without debris, smoothed if it is raw, decimated to about `points` of its own vertices.

    Raises NotEnoughSurface when only debris is left.
    """
    mesh = select(mesh, _large_pieces(mesh))
    if len(mesh.vertices) <= points:
        return mesh
    vertices, faces = mesh.vertices, mesh.faces
    if len(vertices) > RAW_RATIO * points:
        vertices, faces = patch_and_smooth(vertices, faces)
    kept, faces = decimate(vertices, faces, points, own_vertices=True)
    _, index = cKDTree(vertices).query(kept)
    texcoords = None if mesh.texcoords is None else mesh.texcoords[index]
    return replace(mesh, vertices=kept, faces=faces, texcoords=texcoords)


def weld(mesh: SurfaceMesh) -> SurfaceMesh:
    """The mesh with coincident vertices of one texture pixel merged: many files repeat them for every triangle."""
    keys = mesh.vertices if mesh.texcoords is None else np.hstack([mesh.vertices, np.rint(mesh.texcoords)])
    _, first, index = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    if len(first) == len(keys):
        return mesh
    texcoords = None if mesh.texcoords is None else mesh.texcoords[first]
    return replace(mesh, vertices=mesh.vertices[first], faces=index.reshape(-1)[mesh.faces], texcoords=texcoords)


def select(mesh: SurfaceMesh, faces: Ints) -> SurfaceMesh:
    """The mesh with only these faces (m, 3), and only the vertices that they use."""
    used, faces = compact(np.arange(len(mesh.vertices)), faces)
    texcoords = None if mesh.texcoords is None else mesh.texcoords[used]
    return replace(mesh, vertices=mesh.vertices[used], faces=faces, texcoords=texcoords)


def large_pieces(mesh: ValidMesh) -> list[Mask]:
    """Masks (m,) of the faces of every connected piece that is no debris, in the order of their first vertices."""
    label = components(mesh.sides.edges, len(mesh.vertices))[mesh.faces[:, 0]]
    sizes = np.bincount(label)
    return [label == piece for piece in np.flatnonzero(sizes >= max(1.0, MIN_PIECE_SHARE * sizes.max()))]


def _large_pieces(mesh: SurfaceMesh) -> Ints:
    """The faces (m, 3) that are real triangles in pieces large enough to be part of a page."""
    a, b, c = (mesh.faces[:, k] for k in range(3))
    faces = mesh.faces[(a != b) & (b != c) & (c != a)]
    if len(faces) == 0:
        raise NotEnoughSurface("the mesh has no triangles", "scan the page again or give a mesh with triangles")
    parts = [piece.vertices[piece.faces] for piece in pieces(make_network(mesh.vertices, faces))]
    min_faces = MIN_PIECE_SHARE * max(map(len, parts))
    return np.concatenate([part for part in parts if len(part) >= min_faces])
