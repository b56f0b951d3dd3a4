"""From the prepared surface to the flat page: a coarse mesh that settles, and a fine one that carries the picture."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

import numpy as np

from restore.align import border_of, square_up
from restore.clean import clean
from restore.decimate import decimate, depth_distance
from restore.flatten import OnStep, flatten_points
from restore.flatten.network import edges_of
from restore.refine import carry, refine
from restore.scan import FlatMesh, Floats, SurfaceMesh
from restore.settings import Settings
from restore.strain import signed_areas
from restore.surface import Sheet
from restore.triangulate import lattice

DENSE_STRIDE = 4  # samples: the facets have averaged 7×7 of them, and decimation costs a tenth of the time this way

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


def unroll(surface: Sheet | SurfaceMesh, settings: Settings, clock: Clock, on_step: OnStep | None = None) -> Unrolled:
    """Flatten a prepared surface with about `settings.points` points; clock(stage) times the stages."""
    if isinstance(surface, Sheet):
        return _unroll_sheet(surface, settings, clock, on_step)
    return _unroll_mesh(surface, settings, clock, on_step)


def _unroll_sheet(sheet: Sheet, settings: Settings, clock: Clock, on_step: OnStep | None) -> Unrolled:
    with clock("decimate"):
        dense, faces = lattice(sheet.inside, DENSE_STRIDE)
        vertices, faces = decimate(sheet.points(dense), faces, settings.points)
        nodes = np.stack(sheet.rays.grid(vertices), axis=1)
        mesh = SurfaceMesh(vertices, faces, sheet.texcoords(nodes), sheet.scan.texture, sheet.scan.provenance)
        distance = depth_distance(sheet, nodes, faces)
    with clock("flatten"):
        lengths = sheet.lengths(nodes, edges_of(faces))
        coarse = flatten_points(mesh, settings.method, lengths=lengths, on_step=on_step)
    with clock("refine"):
        fine, fine_nodes = refine(sheet, coarse, nodes)
        fine = _square(fine)
        flat = carry(sheet.inside.shape, fine_nodes, fine.faces, fine.flat, nodes)
    return Unrolled(replace(coarse, flat=flat), fine, fine_nodes, distance)


def _unroll_mesh(mesh: SurfaceMesh, settings: Settings, clock: Clock, on_step: OnStep | None) -> Unrolled:
    with clock("decimate"):
        mesh = clean(mesh, settings.points)
    with clock("flatten"):
        flat = _square(flatten_points(mesh, settings.method, on_step=on_step))
    return Unrolled(flat, flat, np.empty((0, 2)), {})


def _square(flat: FlatMesh) -> FlatMesh:
    """Turn a rectangular page square to the picture."""
    area = float(signed_areas(flat.flat, flat.faces).sum())
    turn = square_up(flat.flat[border_of(flat.faces)], area)
    centre = flat.flat.mean(axis=0)
    return replace(flat, flat=(flat.flat - centre) @ turn.T + centre)
