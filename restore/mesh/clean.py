"""Clean a mesh that has no range grid: drop debris, close pinholes, smooth noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from restore.errors import NotEnoughSurface
from restore.findings import Finding
from restore.mesh.adjacency import components
from restore.mesh.decimate import decimate, patch_and_smooth
from restore.mesh.network import make_network, pieces
from restore.mesh.places import first_at_place, first_in_chart
from restore.mesh.topology import Topology
from restore.mesh.triangulate import MIN_PIECE_FRACTION, compact
from restore.mesh.validate import ValidMesh, validated
from restore.numerics.robust import MAJORITY
from restore.scan import Ints, SurfaceMesh

RAW_RATIO = 5  # times the points requested: a denser mesh is a scanner's own, a coarser one was decimated before

MAX_PIECES = 500  # of a page: one that was torn up further is put together by hand before


def clean(mesh: SurfaceMesh, points: int) -> SurfaceMesh:
    """Return the mesh without debris, decimated to about `points` vertices.

    It is smoothed first if it is raw. The vertices left are its own.
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
    """Merge coincident vertices of one texture pixel.

    Many files repeat them for every triangle.
    """
    place = first_at_place(mesh.vertices)
    first = place if mesh.texcoords is None else first_in_chart(place, mesh.texcoords)
    kept = first == np.arange(len(first))
    if kept.all():
        return mesh
    texcoords = None if mesh.texcoords is None else mesh.texcoords[kept]
    number = np.cumsum(kept) - 1
    return replace(mesh, vertices=mesh.vertices[kept], faces=number[first][mesh.faces], texcoords=texcoords)


def select(mesh: SurfaceMesh, faces: Ints) -> SurfaceMesh:
    """The mesh with only these faces (m, 3), and only the vertices that they use."""
    used, faces = compact(np.arange(len(mesh.vertices)), faces)
    texcoords = None if mesh.texcoords is None else mesh.texcoords[used]
    return replace(mesh, vertices=mesh.vertices[used], faces=faces, texcoords=texcoords)


def large_pieces(mesh: ValidMesh) -> list[Ints]:
    """Return the face numbers (k,) of connected pieces but debris, in order of vertices.

    Raises NotEnoughSurface for more than MAX_PIECES of them: a surface in fragments that nothing puts together.
    """
    label = components(mesh.topology.edges, len(mesh.vertices))[mesh.faces[:, 0]]
    sizes = np.bincount(label)
    large = np.flatnonzero(sizes >= max(1.0, MIN_PIECE_FRACTION * sizes.max()))
    if len(large) > MAX_PIECES:
        raise NotEnoughSurface(
            f"the surface falls apart into {np.count_nonzero(sizes)} pieces: its triangles do not hang together",
            "join the vertices that lie at one place in a mesh editor, and export it again",
        )
    order, ends = np.argsort(label, kind="stable"), np.cumsum(sizes)
    return [order[ends[piece] - sizes[piece] : ends[piece]] for piece in large]


def without_debris(mesh: ValidMesh) -> tuple[ValidMesh, list[Finding]]:
    """Return a mesh without debris, and a finding if that is much.

    Much is more than MIN_PIECE_FRACTION of its area. Raises NotEnoughSurface where debris is most of it.
    """
    large = large_pieces(mesh)
    kept = np.zeros(len(mesh.faces), bool)
    for piece in large:
        kept[piece] = True
    areas = np.linalg.norm(mesh.normals, axis=1)
    left_out = float(areas[~kept].sum() / areas.sum())
    if left_out <= MIN_PIECE_FRACTION:
        return mesh, []
    if left_out > MAJORITY:
        raise NotEnoughSurface(
            f"{left_out:.0%} of the surface is in scraps: its triangles do not hang together",
            "join the vertices that lie at one place in a mesh editor, and export it again",
        )
    return validated(select(mesh, mesh.faces[kept])), [Finding.of("debris", left_out)]


def _large_pieces(mesh: SurfaceMesh) -> Ints:
    """Return the faces (m, 3) of pieces large enough for a page.

    Faces are real triangles.
    """
    a, b, c = (mesh.faces[:, k] for k in range(3))
    faces = mesh.faces[(a != b) & (b != c) & (c != a)]
    if len(faces) == 0:
        raise NotEnoughSurface("the mesh has no triangles", "scan the page again or give a mesh with triangles")
    parts = [piece.vertices[piece.faces] for piece in pieces(make_network(mesh.vertices, Topology(faces)))]
    min_faces = MIN_PIECE_FRACTION * max(map(len, parts))
    return np.concatenate([part for part in parts if len(part) >= min_faces])
