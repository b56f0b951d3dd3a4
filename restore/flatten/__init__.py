"""Flatten a surface mesh to the page it once was."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from restore.errors import BadInput, NotEnoughSurface
from restore.flatten.conformal import flatten_conformal
from restore.flatten.lay import Laid, lay, upright
from restore.flatten.network import Network, make_network, pieces
from restore.flatten.orient import orient
from restore.flatten.springs import flatten_springs
from restore.flatten.sticks import flatten_sticks
from restore.scan import FlatMesh, Floats, Ints, SurfaceMesh
from restore.strain import surface_area

OnStep = Callable[[int, Floats, Ints], None]
"""Called after each time step with its number, the positions (n, 3) mm and the faces (m, 3)."""

Solver = Callable[[Laid, Network, Callable[[int, Floats], None] | None], tuple[Floats, int]]

# method → solver of one connected piece; laid on the table in, flat positions (n, 2) mm and time steps out.
METHODS: dict[str, Solver] = {"sticks": flatten_sticks, "springs": flatten_springs, "conformal": flatten_conformal}


def flatten(
    mesh: SurfaceMesh, method: str = "sticks", *, lengths: Floats | None = None, on_step: OnStep | None = None
) -> FlatMesh:
    """Unroll a mesh into the plane, every edge as near to its length on the surface as can be.

    lengths (e,) mm are the rest lengths of the mesh's edges in the order of `network.edges_of`; the straight distances
    between the vertices when None. Each connected piece is flattened by itself and stays where the scan had it. Faces
    that run the wrong way round are turned.
    Raises BadInput for an unknown method, a broken mesh or lengths that are not one for each edge, NotEnoughSurface for
    a mesh without area or without a border.
    """
    if method not in METHODS:
        raise BadInput(f"there is no flattening method {method!r}", f"use one of: {', '.join(METHODS)}")
    check(mesh)
    mesh = replace(mesh, faces=orient(mesh.faces, mesh.texcoords))
    flat = np.zeros((len(mesh.vertices), 2))
    steps = 0
    network = make_network(mesh.vertices, mesh.faces, lengths)
    if len(network.hinges) == len(network.edges):
        raise NotEnoughSurface("the surface is closed all round: a page has a border", "cut the page out of the mesh")
    seen = lay(mesh.vertices, mesh.faces).seen  # from one side for all pieces
    for piece in pieces(network):
        laid = replace(lay(mesh.vertices[piece.vertices], piece.faces), seen=seen[piece.vertices])
        follow = _follower(on_step, mesh, piece.vertices) if on_step else None
        positions, taken = METHODS[method](laid, piece.network, follow)
        flat[piece.vertices] = upright(positions, laid)
        steps = max(steps, taken)
    fields: dict[str, Any] = {name: getattr(mesh, name) for name in SurfaceMesh.__dataclass_fields__}
    return FlatMesh(**fields, flat=flat, lengths=network.lengths, steps=steps)


def check(mesh: SurfaceMesh) -> None:
    """Raise unless the mesh has faces with an area, finite vertices, indices in range and whole texture coordinates."""
    if len(mesh.faces) == 0:
        raise NotEnoughSurface("the mesh has no faces", "scan the page again or give a mesh with triangles")
    if not np.isfinite(mesh.vertices).all():
        raise BadInput("the mesh has vertices that are not finite", "remove them and try again")
    if mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices):
        raise BadInput("the mesh has faces that name vertices it does not have", "the file is damaged: export it again")
    if mesh.texcoords is not None and mesh.texcoords.shape != (len(mesh.vertices), 2):
        raise BadInput("the mesh has no texture coordinate for some vertices", "the file is damaged: export it again")
    if surface_area(mesh.vertices, mesh.faces) == 0.0:
        raise NotEnoughSurface("the faces of the mesh have no area", "scan the page again or give a mesh of a surface")


def _follower(on_step: OnStep, mesh: SurfaceMesh, vertices: Ints) -> Callable[[int, Floats], None]:
    everything = mesh.vertices.copy()

    def follow(step: int, positions: Floats) -> None:
        everything[vertices] = positions
        on_step(step, everything.copy(), mesh.faces)

    return follow
