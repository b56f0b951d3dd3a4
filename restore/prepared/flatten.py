"""Flattens a mesh of any size.

A large one is resampled as a scanner would see it, which removes its noise.
"""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import numpy as np

from restore.flattening.isometric.page import least_absolute_page
from restore.flattening.isometric.repair import uninverted
from restore.flattening.layout import arrange_pieces
from restore.flattening.methods import DEFAULT, METHODS, OnStep, flatten_points, flatten_with_lengths
from restore.flattening.ordered_grid import flatten_grid, points_on_grid, typical_links
from restore.flattening.solution import Solution
from restore.mesh.clean import select
from restore.mesh.decimate import patch_and_smooth
from restore.mesh.jets import rings_of
from restore.mesh.measures import flipped_faces, signed_areas, straight_lengths
from restore.mesh.network import make_network, pieces
from restore.mesh.ordered_grid import GridMesh
from restore.mesh.pose import move_upright, pose_on_table
from restore.mesh.surface_lengths import estimate_noise_sigma, surface_lengths
from restore.mesh.topology import Topology
from restore.mesh.validate import validated
from restore.page import FlatMesh
from restore.prepared.facet_sheet import unroll
from restore.prepared.refine import interpolate_flat_positions
from restore.range_image.fit_sheet import MESH_PRECISION, fit_sheet
from restore.range_image.resample import MIN_VERTICES, resample
from restore.range_image.segmentation.segment import segment
from restore.runtime.arguments import checks_types
from restore.scan import Floats, Ints, SurfaceMesh
from restore.scan_check import refuse_unusable_mesh
from restore.settings import Settings

CLEAN = 0.002  # of the mean edge: noise that no scanner is without


@checks_types
def flatten(
    mesh: SurfaceMesh, method: str = "isometric", *, lengths: Floats | None = None, on_step: OnStep | None = None
) -> FlatMesh:
    """Flatten a mesh, with its edges near their lengths on the surface.

    The vertices of a piece of less than MIN_VERTICES are all solved together; those of a larger one are solved on few
    points, and its noise is removed. Each connected piece stays where the scan had it, unless it would overlap another.
    Faces of the wrong orientation are reversed. An ordered grid keeps its order.
    lengths: (e,) mm, rest lengths of the edges in the order of `Topology.edges`; None for those along the surface that
        the vertices sample.
    on_step: called as on_step(step, positions (n, 3) mm, faces (m, 3)) after each time step.
    Raises BadInput for an unknown method, a damaged mesh or lengths that are not one for each edge, NotEnoughSurface
    for a mesh without area or without a border.

    A square of 10 mm that stands upright:

    >>> corners = np.array([[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]], float)[:, [0, 2, 1]]
    >>> page = flatten(SurfaceMesh(corners, np.array([[0, 1, 3], [1, 2, 3]])))
    >>> page.flat.shape, round(float(np.linalg.norm(page.flat[0] - page.flat[2])), 3)
    ((4, 2), 14.142)
    """
    refuse_unusable_mesh(mesh)
    if isinstance(mesh, GridMesh):
        if method == DEFAULT and lengths is None:
            return replace(flatten_grid(mesh, len(mesh.vertices))[0], vertices=mesh.vertices)
        unordered = SurfaceMesh(
            mesh.vertices, mesh.faces, mesh.texcoords, mesh.texture, mesh.provenance, findings=mesh.findings
        )
        return _in_order(flatten(unordered, method, lengths=lengths, on_step=on_step), mesh)
    if lengths is not None:
        return flatten_with_lengths(mesh, lengths, method, on_step=on_step)
    if method not in METHODS or len(mesh.vertices) < MIN_VERTICES:
        return flatten_points(mesh, method, on_step=on_step)
    mesh = validated(mesh)
    network = make_network(mesh.vertices, mesh.topology)
    parts = list(pieces(network))
    flat, rest = np.zeros((len(mesh.vertices), 2)), network.lengths.copy()
    worst = Solution(flat, 0)
    seen = pose_on_table(mesh.vertices, mesh.faces).seen  # from one side for all pieces
    for part in parts:
        piece = _flatten_piece(select(mesh, part.vertices[part.faces]), method, on_step)
        posed = pose_on_table(piece.vertices, piece.faces)
        flat[part.vertices] = move_upright(piece.flat, replace(posed, seen=seen[part.vertices]))
        rest[np.isin(network.edges[:, 0], part.vertices)] = piece.lengths
        worst = worst.joined(Solution(piece.flat, piece.iterations, **piece.convergence))
    arrange_pieces(flat, [(part.vertices, part.faces) for part in parts])
    return FlatMesh.of(mesh, flat, rest, worst.iterations, **worst.convergence)


def _in_order(page: FlatMesh, grid: GridMesh) -> FlatMesh:
    """Return the page of a grid, each piece in the grid's orientation.

    Columns run to the right and rows down; a mirrored piece is flipped.
    """
    (along, _), (down, _) = typical_links(points_on_grid(grid))
    rows, cols = np.divmod(grid.places, grid.shape[1])
    wanted, flat = np.stack([along * cols, -down * rows], axis=1), page.flat.copy()
    parts = list(pieces(make_network(page.vertices, page.topology)))
    for part in parts:
        own = flat[part.vertices]
        if signed_areas(own, part.faces).sum() < 0.0:
            own = own * [-1.0, 1.0]
        posed = pose_on_table(page.vertices[part.vertices], part.faces)
        flat[part.vertices] = move_upright(own, replace(posed, seen=wanted[part.vertices]))
    arrange_pieces(flat, [(part.vertices, part.faces) for part in parts])
    return replace(page, flat=flat)


def _flatten_piece(mesh: SurfaceMesh, method: str, on_step: OnStep | None) -> FlatMesh:
    if len(mesh.vertices) < MIN_VERTICES:
        return flatten_points(mesh, method, on_step=on_step)
    return _over_grid(mesh, method, on_step) or _over_points(mesh, method, on_step)


def _over_grid(mesh: SurfaceMesh, method: str, on_step: OnStep | None) -> FlatMesh | None:
    """As a scanner would see it, for a mesh that one view sees all of; None for others."""
    view = resample(mesh)
    if view is None:
        return None
    scan, rays = view
    sheet = fit_sheet(segment(scan, rays, scan.measured), precision=MESH_PRECISION)
    unrolled = unroll(sheet, Settings(method=method), lambda _: nullcontext(), on_step)
    nodes = np.stack(sheet.rays.grid(mesh.vertices), axis=1)
    flat = interpolate_flat_positions(
        sheet.inside.shape, unrolled.nodes, unrolled.fine.faces, unrolled.fine.flat, nodes
    )
    topology = Topology(mesh.faces)
    lengths = sheet.lengths(nodes, topology.edges)
    if _clean(mesh, topology.edges, lengths):  # then its vertices know better
        lengths = surface_lengths(mesh.vertices, topology)
        flat = least_absolute_page(flat, make_network(mesh.vertices, topology, lengths)).flat
    if flipped_faces(flat, mesh.faces):  # noise has put a vertex beyond its neighbours
        flat = uninverted(flat, make_network(mesh.vertices, topology, lengths), np.ones(len(mesh.faces)))
    return FlatMesh.of(mesh, flat, lengths, unrolled.coarse.iterations, **unrolled.fine.convergence)


def _over_points(mesh: SurfaceMesh, method: str, on_step: OnStep | None) -> FlatMesh:
    """By its own vertices alone, smoothed where they are noisy."""
    edges = Topology(mesh.faces).edges
    if _clean(mesh, edges, straight_lengths(mesh.vertices, edges)):
        return flatten_points(mesh, method, on_step=on_step)
    smoothed, _ = patch_and_smooth(mesh.vertices, mesh.faces)
    page = flatten_points(replace(mesh, vertices=smoothed), method, on_step=on_step)
    return replace(page, vertices=mesh.vertices)


def _clean(mesh: SurfaceMesh, edges: Ints, lengths: Floats) -> bool:
    """Return whether the vertices of a mesh are where its surface is.

    edges: (e, 2), of lengths (e,) mm.
    """
    noise = estimate_noise_sigma(mesh.vertices, rings_of(mesh.vertices, mesh.faces, edges))
    return bool(noise < CLEAN * lengths.mean())
