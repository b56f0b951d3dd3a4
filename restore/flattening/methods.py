"""Flatten a surface mesh to the page it once was."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from restore.errors import BadInput, NotEnoughSurface
from restore.flattening.conformal import flatten_conformal
from restore.flattening.fans import face_signs
from restore.flattening.isometric import CAP, MOST_STRAIN, flatten_isometric, flatten_least_distorted
from restore.flattening.joints import flatten_parts
from restore.flattening.layout import arrange_pieces
from restore.flattening.repair import least_strain_page
from restore.flattening.solution import Follow, Solution
from restore.flattening.springs import flatten_springs
from restore.flattening.sticks import flatten_sticks
from restore.mesh.measures import rms_strain, straight_lengths
from restore.mesh.network import Network, Piece, make_network, pieces
from restore.mesh.pose import PosedSheet, pose_on_table
from restore.mesh.surface_lengths import surface_lengths
from restore.mesh.topology import refuse_unflattenable
from restore.mesh.validate import ValidMesh, validated
from restore.scan import FlatMesh, Floats, Ints, SurfaceMesh

OnStep = Callable[[int, Floats, Ints], None]
"""Called after each step with its number, the positions (n, 3) mm and the faces (m, 3)."""

Solver = Callable[[PosedSheet, Network, Follow | None], Solution]

# method → solver of one connected piece over the table.
METHODS: dict[str, Solver] = {
    "isometric": flatten_isometric,
    "sticks": flatten_sticks,
    "springs": flatten_springs,
    "conformal": flatten_conformal,
}

LEAST_STRAIN = ("isometric", "sticks")  # end where the edges are strained least
SIMPLER = 0.5  # of the squared strain that estimated lengths leave: chords, which no noise or crease can mislead by
# more than they cut short, are taken where they contradict each other no more than half as much


def flatten_points(
    mesh: SurfaceMesh, method: str = "isometric", *, lengths: Floats | None = None, on_step: OnStep | None = None
) -> FlatMesh:
    """The page of least strain of all vertices of a mesh, every edge as near to its length on the surface as can be.

    lengths (e,) mm are the rest lengths of the mesh's edges in the order of `network.edges_of`; when None, those along
    the surface that the vertices sample (`surface_lengths`).
    Each connected piece is flattened by itself and stays where the scan had it, unless it would lie over another. Faces
    that run the wrong way round are turned.
    Raises BadInput for an unknown method, a mesh that is broken, one-sided or a closed band, or lengths that are not
    one for each edge, NotEnoughSurface for a mesh without area or without a border.
    """
    if method not in METHODS:
        raise BadInput(f"there is no flattening method {method!r}", f"use one of: {', '.join(METHODS)}")
    mesh = validated(mesh)
    refuse_unflattenable(mesh.vertices, mesh.faces, mesh.sides)
    page = _with_lengths(mesh, method, on_step, lengths)
    if method == "isometric" and rms_strain(page.flat, mesh.sides.edges, page.lengths, CAP) > MOST_STRAIN:
        return _flattened(mesh, flatten_least_distorted, page.lengths, on_step)
    return page


def _with_lengths(mesh: ValidMesh, method: str, on_step: OnStep | None, lengths: Floats | None) -> FlatMesh:
    """The page with the lengths given, or estimated along the surface, or chords where those fit better."""
    solver = METHODS[method]
    if lengths is not None:
        return _flattened(mesh, solver, lengths, on_step)
    edges, chords = mesh.sides.edges, straight_lengths(mesh.vertices, mesh.sides.edges)
    page = _flattened(mesh, solver, surface_lengths(mesh.vertices, mesh.faces, edges), on_step)
    if method not in LEAST_STRAIN:
        return page
    network = make_network(mesh.vertices, mesh.faces, chords, mesh.sides)
    chords = network.lengths  # none of them is zero
    other = least_strain_page(page.flat, network, face_signs(mesh.vertices, mesh.faces))
    energy, of_chords = _energy(page.flat, edges, page.lengths), _energy(other.flat, edges, chords)
    return replace(page, flat=other.flat, lengths=chords) if of_chords < SIMPLER * energy else page


def _energy(flat: Floats, edges: Ints, lengths: Floats) -> float:
    return float(rms_strain(flat, edges, lengths, np.inf) ** 2)


def _flattened(mesh: ValidMesh, solver: Solver, lengths: Floats, on_step: OnStep | None) -> FlatMesh:
    """Each connected piece by itself, then all of them side by side."""
    network = make_network(mesh.vertices, mesh.faces, lengths, mesh.sides)
    if len(network.hinges) == len(network.edges):
        raise NotEnoughSurface("the surface is closed all round: a page has a border", "cut the page out of the mesh")
    flat, arranged = np.zeros((len(mesh.vertices), 2)), list[tuple[Ints, Ints]]()
    whole, worst = pose_on_table(mesh.vertices, mesh.faces), Solution(flat, 0)
    for piece in pieces(network):

        def solve(posed: PosedSheet, part: Piece, among: Ints = piece.vertices) -> Solution:
            follow = _follower(on_step, mesh, among[part.vertices]) if on_step else None
            return solver(posed, part.network, follow)

        found = flatten_parts(mesh.vertices, piece, whole, solve)
        flat[piece.vertices], worst = found.flat, worst.joined(found)
        arranged.append((piece.vertices, piece.faces))
    arrange_pieces(flat, arranged)
    steps, convergence = worst.iterations, {"residual": worst.residual, "converged": worst.converged}
    return FlatMesh.of(mesh, flat, network.lengths, steps, **convergence)


def _follower(on_step: OnStep, mesh: SurfaceMesh, vertices: Ints) -> Callable[[int, Floats], None]:
    everything = mesh.vertices.copy()

    def follow(step: int, positions: Floats) -> None:
        everything[vertices] = positions
        on_step(step, everything.copy(), mesh.faces)

    return follow
