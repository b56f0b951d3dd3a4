"""From the prepared surface to the flat page: a coarse mesh that settles, and a fine one that carries the picture."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

import numpy as np

from restore.flattening.methods import OnStep, flatten_points
from restore.mesh.adjacency import border_of
from restore.mesh.decimate import decimate
from restore.mesh.measures import signed_areas
from restore.mesh.network import edges_of
from restore.mesh.triangulate import lattice
from restore.outline.rectangle import square_up
from restore.outline.sides import straighten
from restore.range_image.sheet import Sheet, depth_distance
from restore.refine import carry, refine
from restore.scan import FlatMesh, Floats, SurfaceMesh
from restore.settings import Settings

MOST_SETTLED = 10_000  # points; more add nothing to what they know of the sheet, and cost seconds
STRIDES = (1, 2, 3, 4)  # samples: the facets have averaged 7×7 of them, and decimation costs a tenth of the time at 4
SPARE = 1.0  # nodes for each point that is asked for

Clock = Callable[[str], AbstractContextManager[None]]


@dataclass(frozen=True, eq=False)
class Unrolled:
    """The flat page as meshes.

    coarse    the points that settled, where the fine mesh has them.
    fine      the mesh that carries the picture.
    nodes     (k, 2) grid positions of the vertices of the fine mesh; none for a mesh without a grid.
    distance  how far the coarse mesh lies from the surface, mm; empty for a mesh without a grid.
    """

    coarse: FlatMesh
    fine: FlatMesh
    nodes: Floats
    distance: dict[str, float]


def unroll(sheet: Sheet, settings: Settings, clock: Clock, on_step: OnStep | None = None) -> Unrolled:
    """Flatten a prepared sheet with about `settings.points` points; clock(stage) times the stages.

    More points than MOST_SETTLED do not settle themselves: they are carried along by those that do.
    """
    wanted = settings.points or int(sheet.inside.sum())
    with clock("decimate"):
        mesh, nodes = thin_out(sheet, min(wanted, MOST_SETTLED))
        distance = depth_distance(sheet, nodes, mesh.faces)
    with clock("flatten"):
        lengths = sheet.lengths(nodes, edges_of(mesh.faces))
        coarse = flatten_points(mesh, settings.method, lengths=lengths, on_step=on_step)
    with clock("refine"):
        fine, fine_nodes = refine(sheet, coarse, nodes)
        fine, fine_nodes = straighten(sheet, square(fine), fine_nodes)
        if wanted > MOST_SETTLED:
            mesh, nodes = thin_out(sheet, wanted)
        points = _carried(sheet, fine, fine_nodes, mesh, nodes, coarse.steps)
    return Unrolled(points, fine, fine_nodes, distance)


def thin_out(sheet: Sheet, points: int) -> tuple[SurfaceMesh, Floats]:
    """About so many points of the sheet, and their grid positions (n, 2)."""
    enough = [stride for stride in STRIDES if sheet.inside.sum() >= SPARE * points * stride**2]
    nodes, faces = lattice(sheet.inside, max(enough, default=1))
    vertices, faces = decimate(sheet.points(nodes), faces, points)
    nodes = np.stack(sheet.rays.grid(vertices), axis=1)
    return SurfaceMesh(vertices, faces, sheet.texcoords(nodes), sheet.scan.texture, sheet.scan.provenance), nodes


def _carried(
    sheet: Sheet, fine: FlatMesh, fine_nodes: Floats, mesh: SurfaceMesh, nodes: Floats, steps: int
) -> FlatMesh:
    """A mesh at grid positions nodes (n, 2) laid where the fine mesh, at fine_nodes (k, 2), has it."""
    edges = edges_of(mesh.faces)
    flat = carry(sheet.inside.shape, fine_nodes, fine.faces, fine.flat, nodes)
    lengths = sheet.lengths(nodes, edges)
    return FlatMesh.of(mesh, flat, lengths, steps)


def square(flat: FlatMesh) -> FlatMesh:
    """Turn a rectangular page square to the picture."""
    area = float(signed_areas(flat.flat, flat.faces).sum())
    turn = square_up(flat.flat[border_of(flat.faces)], area)
    centre = flat.flat.mean(axis=0)
    return replace(flat, flat=(flat.flat - centre) @ turn.T + centre)
