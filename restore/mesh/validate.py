"""Valid meshes: checked once, oriented, with their tables."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from restore.errors import BadInput, NotEnoughSurface
from restore.mesh.adjacency import Sides, order_of_pairs
from restore.mesh.measures import face_normals, surface_area
from restore.mesh.orient import orient
from restore.mesh.topology import Topology
from restore.scan import Floats, Ints, Mask, SurfaceMesh

FARTHEST_MM = 1e60  # whatever the unit: lengths are multiplied by each other up to four times


@dataclass(frozen=True, eq=False)
class ValidMesh(SurfaceMesh):
    """Surface mesh that is valid by construction.

    Making one, also by `dataclasses.replace`, checks its arrays. Faces that name a vertex twice are dropped, since they
    have no area, and so are copies of a face; the others run counter-clockwise on the printed side.
    topology: which faces meet in which edges.
    normals: (m, 3), of the faces, mm², twice as long as their areas.
    Raises BadInput for arrays that are not a triangle mesh, NotEnoughSurface for one without faces or area.
    """

    topology: Topology = field(init=False)
    normals: Floats = field(init=False)

    def __post_init__(self) -> None:
        mesh = _checked(self)
        proper = Topology(mesh.faces)
        if (left_out := _improper(proper.faces, proper.sides)).any():
            proper = Topology(_turned_copies(mesh.vertices, proper.faces, left_out)[~left_out])
        faces = orient(proper.faces, mesh.texcoords, proper.sides)
        topology = proper if faces is proper.faces else Topology(faces)
        derived = {"topology": topology, "normals": face_normals(mesh.vertices, faces)}
        for name, value in {"vertices": mesh.vertices, "faces": faces, **derived}.items():
            object.__setattr__(self, name, value)


def validated(mesh: SurfaceMesh) -> ValidMesh:
    """Return the mesh as a valid one; the same object if it is one.

    Raises BadInput for arrays that are not a triangle mesh, NotEnoughSurface for one without faces or area.
    """
    if isinstance(mesh, ValidMesh):
        return mesh
    return ValidMesh(mesh.vertices, mesh.faces, mesh.texcoords, mesh.texture, mesh.provenance, findings=mesh.findings)


def _checked(mesh: SurfaceMesh) -> SurfaceMesh:
    if np.shape(mesh.faces)[:1] == (0,):
        raise NotEnoughSurface("the mesh has no faces", "scan the page again or give a mesh with triangles")
    vertices, faces = _declared_types(mesh)
    if not np.isfinite(vertices).all():
        raise BadInput("the mesh has vertices that are not finite", "remove them and try again")
    if np.abs(vertices).max() > FARTHEST_MM:
        raise BadInput("the mesh has vertices beyond every page", "the file is damaged: export it again")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise BadInput("the mesh has faces that name vertices it does not have", "the file is damaged: export it again")
    if mesh.texcoords is not None and mesh.texcoords.shape != (len(vertices), 2):
        raise BadInput("the mesh has no texture coordinate for some vertices", "the file is damaged: export it again")
    if surface_area(vertices, faces) == 0.0:
        raise NotEnoughSurface("the faces of the mesh have no area", "scan the page again or give a mesh of a surface")
    return SurfaceMesh(vertices, faces, mesh.texcoords)


def _improper(faces: Ints, sides: Sides) -> Mask:
    """Return the faces (m,) that are degenerate or copies.

    They name a vertex twice, or have the same three vertices as one before them.
    """
    improper: Mask = np.any((sides.edge < 0).reshape(-1, 3), axis=1)
    counts = np.diff(sides.first)
    edge, face = np.repeat(np.arange(len(counts)), counts), sides.at // 3
    third = faces.sum(axis=1).take(face) - sides.edges.sum(axis=1).take(edge)
    if counts.max(initial=0) > 2:  # then copies need not follow each other
        order = order_of_pairs(edge, third, max(len(counts), int(faces.max()) + 1))
        edge, third, face = edge[order], third[order], face[order]
    improper[face[1:][(edge[1:] == edge[:-1]) & (third[1:] == third[:-1])]] = True
    return improper


def _turned_copies(vertices: Floats, faces: Ints, left_out: Mask) -> Ints:
    """Return the faces; those with an omitted copy (m,) are oriented as their neighbours.

    A decimator leaves both sides of a flap, joined to the sheet by one edge: only its normal shows which is up.
    faces: (m, 3).
    """
    named = np.zeros(len(vertices), bool)
    named[faces[left_out]] = True
    candidates = np.flatnonzero(named[faces].all(axis=1))
    _, alike, counts = np.unique(np.sort(faces[candidates], axis=1), axis=0, return_inverse=True, return_counts=True)
    copies = candidates[counts[alike.reshape(-1)] > 1]
    normals = face_normals(vertices, faces)
    about = np.zeros_like(vertices)
    others = np.delete(np.arange(len(faces)), copies)
    np.add.at(about, faces[others].ravel(), np.repeat(normals[others], 3, axis=0))
    against = copies[(about[faces[copies]].sum(axis=1) * normals[copies]).sum(axis=1) < 0.0]
    turned = faces.copy()
    turned[against] = faces[against, ::-1]
    return turned


def _declared_types(mesh: SurfaceMesh) -> tuple[Floats, Ints]:
    """Return vertices (n, 3) float64 and faces (m, 3) int64.

    Raises BadInput for arrays that are not a mesh of triangles.
    """
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    if vertices.shape[1:] != (3,) or faces.shape[1:] != (3,):
        shapes = f"vertices {vertices.shape} and faces {faces.shape}"
        raise BadInput(f"{shapes} are not triangles in space", "give (n, 3) mm and (m, 3) numbers of vertices")
    if vertices.dtype.kind not in "fiu" or faces.dtype.kind not in "iu":
        kinds = f"vertices of {vertices.dtype} and faces of {faces.dtype}"
        raise BadInput(f"{kinds} are not triangles in space", "give millimetres and whole numbers of vertices")
    return vertices.astype(np.float64, copy=False), faces.astype(np.int64, copy=False)
