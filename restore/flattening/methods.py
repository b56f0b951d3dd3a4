"""Flatten a surface mesh to the page it once was."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from restore.errors import BadInput, NotEnoughSurface
from restore.flattening.conformal import flatten_conformal
from restore.flattening.joints import flatten_parts
from restore.flattening.layout import lay_out
from restore.flattening.settle import settle
from restore.flattening.springs import flatten_springs
from restore.flattening.sticks import flatten_sticks
from restore.mesh.measures import rms_strain, straight_lengths
from restore.mesh.network import Network, Piece, make_network, pieces
from restore.mesh.pose import Laid, lay
from restore.mesh.surface_lengths import surface_lengths
from restore.mesh.validate import ValidMesh, validated
from restore.scan import FlatMesh, Floats, Ints, SurfaceMesh

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
    mesh = validated(mesh)
    if lengths is not None:
        return _settle(mesh, method, lengths, on_step)
    edges = mesh.sides.edges
    page = _settle(mesh, method, surface_lengths(mesh.vertices, mesh.faces, edges), on_step)
    if (strained := _rms_strain(page, edges)) < DOUBTFUL:
        return page
    straight = straight_lengths(mesh.vertices, edges)
    near = replace(page, flat=settle(page.flat, edges, straight, TELLING), lengths=straight)
    if strained < UNSOUND and _rms_strain(near, edges) > CLEARLY * strained:
        return page
    chords = _settle(mesh, method, straight, on_step)
    return chords if _rms_strain(chords, edges) < CLEARLY * strained else page


def _rms_strain(page: FlatMesh, edges: Ints) -> float:
    return rms_strain(page.flat, edges, page.lengths, OUTLYING)


def _settle(mesh: ValidMesh, method: str, lengths: Floats, on_step: OnStep | None) -> FlatMesh:
    """Each connected piece by itself, then all of them side by side."""
    network = make_network(mesh.vertices, mesh.faces, lengths, mesh.sides)
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


def _follower(on_step: OnStep, mesh: SurfaceMesh, vertices: Ints) -> Callable[[int, Floats], None]:
    everything = mesh.vertices.copy()

    def follow(step: int, positions: Floats) -> None:
        everything[vertices] = positions
        on_step(step, everything.copy(), mesh.faces)

    return follow
