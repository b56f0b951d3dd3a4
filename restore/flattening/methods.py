"""Flatten a surface mesh to the page it once was."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from restore.errors import BadInput, NotEnoughSurface
from restore.flattening.conformal import flatten_conformal
from restore.flattening.isometric.page import flatten_by_least_squares, flatten_isometric, stretched
from restore.flattening.isometric.two_lengths import with_surface_lengths
from restore.flattening.joints import flatten_parts
from restore.flattening.layout import arrange_pieces
from restore.flattening.published.applicable import flatten_applicable
from restore.flattening.published.springs import flatten_springs
from restore.flattening.published.sticks import flatten_sticks
from restore.flattening.solution import Follow, Solution
from restore.mesh.flattenable import refuse_narrow, refuse_unflattenable
from restore.mesh.network import Network, Piece, make_network, pieces
from restore.mesh.pose import PosedSheet, pose_on_table
from restore.mesh.surface_lengths import straight_and_along, surface_lengths
from restore.mesh.validate import ValidMesh, validated
from restore.page import FlatMesh
from restore.scan import Floats, Ints, SurfaceMesh

OnStep = Callable[[int, Floats, Ints], None]
"""Called after each step with its number, the positions (n, 3) mm and the faces (m, 3)."""

Solver = Callable[[PosedSheet, Network, Follow | None], Solution]

# method → solver of one connected piece over the table.
METHODS: dict[str, Solver] = {
    "isometric": flatten_isometric,
    "sticks": flatten_sticks,
    "springs": flatten_springs,
    "conformal": flatten_conformal,
    "applicable": flatten_applicable,
}

DEFAULT = "isometric"


def flatten_with_lengths(
    mesh: SurfaceMesh, lengths: Floats, method: str = DEFAULT, *, on_step: OnStep | None = None
) -> FlatMesh:
    """Flatten a mesh with given edge lengths.

    Each connected piece is flattened separately and stays where the scan had it, unless it would overlap another. Faces
    of the wrong orientation are reversed.
    lengths: (e,) mm, rest lengths in the order of `Topology.edges`.
    Raises BadInput for an unknown method, a mesh that is damaged, one-sided or a closed band, or lengths that are not
    one for each edge, NotEnoughSurface for a mesh without area or without a border.
    """
    return flatten_with(_flattenable(mesh, method), METHODS[method], lengths, on_step)


def flatten_points(mesh: SurfaceMesh, method: str = DEFAULT, *, on_step: OnStep | None = None) -> FlatMesh:
    """Flatten a mesh by the surface lengths that its vertices sample.

    The default method takes them as far as they agree (`two_lengths.py`). Pieces and errors as those of
    `flatten_with_lengths`.
    """
    mesh = _flattenable(mesh, method)
    if method != DEFAULT:
        return flatten_with(mesh, METHODS[method], surface_lengths(mesh.vertices, mesh.topology), on_step)
    straight, along = straight_and_along(mesh.vertices, mesh.topology)
    page = with_surface_lengths(flatten_with(mesh, flatten_by_least_squares, straight, on_step), mesh, along)
    strained = stretched(page.flat, mesh.topology.edges, page.lengths)
    return flatten_with(mesh, flatten_isometric, page.lengths, on_step) if strained else page


def _flattenable(mesh: SurfaceMesh, method: str) -> ValidMesh:
    if method not in METHODS:
        raise BadInput(f"the flattening method {method!r} does not exist", f"use one of: {', '.join(METHODS)}")
    mesh = validated(mesh)
    refuse_unflattenable(mesh.vertices, mesh.topology)
    return mesh


def flatten_with(mesh: ValidMesh, solver: Solver, lengths: Floats, on_step: OnStep | None) -> FlatMesh:
    """Flatten each connected piece of a mesh, and arrange the pieces.

    lengths: (e,) mm, rest lengths.
    Raises NotEnoughSurface for a surface without a border, BadInput for a strip without a width.
    """
    network = make_network(mesh.vertices, mesh.topology, lengths)
    if not len(mesh.topology.border):
        raise NotEnoughSurface("the surface is closed all round: a page has a border", "cut the page out of the mesh")
    flat, arranged = np.zeros((len(mesh.vertices), 2)), list[tuple[Ints, Ints]]()
    whole, worst = pose_on_table(mesh.vertices, mesh.faces), Solution(flat, 0)
    parts = list(pieces(network))
    for piece in parts:

        def solve(posed: PosedSheet, part: Piece, among: Ints = piece.vertices) -> Solution:
            follow = _follower(on_step, mesh, among[part.vertices]) if on_step else None
            return solver(posed, part.network, follow)

        found = flatten_parts(mesh.vertices, piece, whole, solve)
        flat[piece.vertices], worst = found.flat, worst.joined(found)
        arranged.append((piece.vertices, piece.faces))
    if worst.converged:  # else the page says itself that it was not found
        refuse_narrow([flat[part.vertices] for part in parts], [float(part.network.areas.sum()) for part in parts])
    arrange_pieces(flat, arranged)
    return FlatMesh.of(mesh, flat, network.lengths, worst.iterations, **worst.convergence)


def _follower(on_step: OnStep, mesh: SurfaceMesh, vertices: Ints) -> Callable[[int, Floats], None]:
    everything = mesh.vertices.copy()

    def follow(step: int, positions: Floats) -> None:
        everything[vertices] = positions
        on_step(step, everything.copy(), mesh.faces)

    return follow
