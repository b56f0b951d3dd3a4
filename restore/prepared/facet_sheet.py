"""From the prepared surface to the flat page: a coarse mesh is flattened, and refined to a fine one for the picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from restore.flattening.methods import OnStep, flatten_points
from restore.mesh.decimate import decimate
from restore.mesh.network import edges_of
from restore.mesh.triangulate import lattice
from restore.outline.sides import straighten
from restore.page import FlatMesh
from restore.prepared.prepared import Clock, Unrolled, square_to_picture
from restore.prepared.refine import interpolate_flat_positions, refine, subdivide
from restore.range_image.facets.sheet import PageOnGrid, Sheet, depth_distance
from restore.scan import Floats, SurfaceMesh
from restore.settings import Settings

MAX_SOLVED_POINTS = 10_000  # vertices; more gain no accuracy and cost seconds
# Samples from node to node of the lattice that is decimated → nodes for each requested point, at least. The facets
# average 7×7 samples; the time of decimation is that of its nodes, and the widest step leaves it a choice of nodes.
STRIDES = {1: 1.0, 2: 1.0, 3: 1.0, 4: 1.0, 5: 6.0, 6: 6.0}


def unroll(sheet: Sheet, settings: Settings, clock: Clock, on_step: OnStep | None = None) -> Unrolled:
    """Flatten a prepared sheet with about `settings.points` points; clock(stage) times the stages.

    Beyond MAX_SOLVED_POINTS points the flat positions are interpolated.
    """
    requested = settings.points or int(sheet.inside.sum())
    with clock("decimate"):
        mesh, nodes = decimate_sheet(sheet, min(requested, MAX_SOLVED_POINTS))
        distance = depth_distance(sheet, nodes, mesh.faces)
    with clock("flatten"):
        lengths = sheet.lengths(nodes, edges_of(mesh.faces))
        coarse = flatten_points(mesh, settings.method, lengths=lengths, on_step=on_step)
    with clock("refine"):
        fine, fine_nodes = refine(sheet, coarse, nodes)
        fine = square_to_picture(fine)
        page = subdivide(sheet, straighten(sheet, PageOnGrid(fine.flat, fine.faces, fine_nodes)))
        fine = _on_sheet(sheet, fine, page)
        if requested > MAX_SOLVED_POINTS:
            mesh, nodes = decimate_sheet(sheet, requested)
        points = _interpolated(sheet, page, mesh, nodes, fine)
    return Unrolled(points, fine, page.nodes, distance)


def decimate_sheet(sheet: Sheet, points: int) -> tuple[SurfaceMesh, Floats]:
    """A mesh of about so many points of the sheet, and their grid positions (n, 2)."""
    samples = int(sheet.inside.sum())
    strides = [stride for stride, nodes in STRIDES.items() if samples >= nodes * points * stride**2]
    nodes, faces = lattice(sheet.inside, max(strides, default=1))
    vertices, faces = decimate(sheet.points(nodes), faces, points)
    nodes = np.stack(sheet.rays.grid(vertices), axis=1)
    source = sheet.scan
    mesh = SurfaceMesh(
        vertices, faces, sheet.texcoords(nodes), source.texture, source.provenance, findings=source.findings
    )
    return mesh, nodes


def _on_sheet(sheet: Sheet, solved: FlatMesh, page: PageOnGrid) -> FlatMesh:
    """The page with its surface, measured on the sheet; solved: the flat mesh that it was made of."""
    flat, faces, nodes = page
    points, texcoords, lengths = sheet.points(nodes), sheet.texcoords(nodes), sheet.lengths(nodes, edges_of(faces))
    return replace(solved, vertices=points, faces=faces, texcoords=texcoords, flat=flat, lengths=lengths)


def _interpolated(sheet: Sheet, page: PageOnGrid, mesh: SurfaceMesh, nodes: Floats, solved: FlatMesh) -> FlatMesh:
    """A mesh at grid positions nodes (n, 2) flattened by interpolation of the page, which was solved."""
    edges = edges_of(mesh.faces)
    flat = interpolate_flat_positions(sheet.inside.shape, page.nodes, page.faces, page.flat, nodes)
    lengths = sheet.lengths(nodes, edges)
    return FlatMesh.of(mesh, flat, lengths, solved.steps, **solved.convergence)
