"""Flatten a surface mesh to the page it once was."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from restore.errors import BadInput, NotEnoughSurface
from restore.flatten.adjacency import Sides, sides_of
from restore.flatten.conformal import flatten_conformal
from restore.flatten.joints import flatten_parts
from restore.flatten.lay import Laid, lay
from restore.flatten.layout import lay_out
from restore.flatten.lengths import surface_lengths
from restore.flatten.network import Network, Piece, make_network, pieces
from restore.flatten.orient import orient
from restore.flatten.settle import settle
from restore.flatten.springs import flatten_springs
from restore.flatten.sticks import flatten_sticks
from restore.scan import FlatMesh, Floats, Ints, SurfaceMesh
from restore.strain import rms_strain, straight_lengths, surface_area

OnStep = Callable[[int, Floats, Ints], None]
"""Called after each time step with its number, the positions (n, 3) mm and the faces (m, 3)."""

Solver = Callable[[Laid, Network, Callable[[int, Floats], None] | None], tuple[Floats, int]]

# method → solver of one connected piece; laid on the table in, flat positions (n, 2) mm and time steps out.
METHODS: dict[str, Solver] = {"sticks": flatten_sticks, "springs": flatten_springs, "conformal": flatten_conformal}

DOUBTFUL = 0.01  # rms strain of an estimate that may be wrong: bends too tight for their points look like creases …
OUTLYING = 0.1  # a single short edge in a tangle may be stretched to several times its length
UNSOUND = 0.03  # rms strain of a page that may have come down folded: what lies near it tells nothing
CLEARLY = 0.7  # … and then the straight lengths fit the plane with so much less strain; facets cost either no more
TELLING = 3  # of Newton's steps towards them: five more take off less than that


def flatten_points(
    mesh: SurfaceMesh, method: str = "sticks", *, lengths: Floats | None = None, on_step: OnStep | None = None
) -> FlatMesh:
    """Let all vertices of a mesh settle in the plane, every edge as near to its length on the surface as can be.

    lengths (e,) mm are the rest lengths of the mesh's edges in the order of `network.edges_of`; when None, those along
    the surface that the vertices sample (`lengths.surface_lengths`), or the straight ones where those do not fit.
    Each connected piece is flattened by itself and stays where the scan had it, unless it would lie over another. Faces
    that run the wrong way round are turned.
    Raises BadInput for an unknown method, a broken mesh or lengths that are not one for each edge, NotEnoughSurface for
    a mesh without area or without a border.
    """
    if method not in METHODS:
        raise BadInput(f"there is no flattening method {method!r}", f"use one of: {', '.join(METHODS)}")
    mesh = checked(mesh)
    sides = sides_of(mesh.faces)
    faces = orient(mesh.faces, mesh.texcoords, sides)
    if faces is not mesh.faces:
        mesh, sides = replace(mesh, faces=faces), sides_of(faces)
    if lengths is not None:
        return _settle(mesh, sides, method, lengths, on_step)
    edges = sides.edges
    page = _settle(mesh, sides, method, surface_lengths(mesh.vertices, mesh.faces, edges), on_step)
    if (strained := _rms_strain(page, edges)) < DOUBTFUL:
        return page
    straight = straight_lengths(mesh.vertices, edges)
    near = replace(page, flat=settle(page.flat, edges, straight, TELLING), lengths=straight)
    if strained < UNSOUND and _rms_strain(near, edges) > CLEARLY * strained:
        return page
    chords = _settle(mesh, sides, method, straight, on_step)
    return chords if _rms_strain(chords, edges) < CLEARLY * strained else page


def _rms_strain(page: FlatMesh, edges: Ints) -> float:
    return rms_strain(page.flat, edges, page.lengths, OUTLYING)


def _settle(mesh: SurfaceMesh, sides: Sides, method: str, lengths: Floats, on_step: OnStep | None) -> FlatMesh:
    """Each connected piece by itself, then all of them side by side."""
    network = make_network(mesh.vertices, mesh.faces, lengths, sides)
    if len(network.hinges) == len(network.edges):
        raise NotEnoughSurface("the surface is closed all round: a page has a border", "cut the page out of the mesh")
    flat, laid_out, steps = np.zeros((len(mesh.vertices), 2)), list[tuple[Ints, Ints]](), 0
    whole = lay(mesh.vertices, mesh.faces)
    for piece in pieces(network):

        def solve(laid: Laid, part: Piece, among: Ints = piece.vertices) -> tuple[Floats, int]:
            follow = _follower(on_step, mesh, among[part.vertices]) if on_step else None
            return METHODS[method](laid, part.network, follow)

        flat[piece.vertices], taken = flatten_parts(mesh.vertices, piece, whole, solve)
        laid_out.append((piece.vertices, piece.faces))
        steps = max(steps, taken)
    lay_out(flat, laid_out)
    return FlatMesh.of(mesh, flat, network.lengths, steps)


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


def _follower(on_step: OnStep, mesh: SurfaceMesh, vertices: Ints) -> Callable[[int, Floats], None]:
    everything = mesh.vertices.copy()

    def follow(step: int, positions: Floats) -> None:
        everything[vertices] = positions
        on_step(step, everything.copy(), mesh.faces)

    return follow
