"""A page over an ordered grid, such as a segment of a CT volume."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from restore.flattening.methods import DEFAULT, OnStep
from restore.flattening.ordered_grid import flatten_grid, thinned
from restore.mesh.ordered_grid import GridMesh
from restore.page import FlatMesh
from restore.prepared.flatten import flatten
from restore.prepared.prepared import Clock, Prepared, Unrolled, square_to_picture, squaring
from restore.settings import Settings

MAX_GRID_POINTS = 250_000  # of an ordered grid: ten times its nodes determine their strain, and more make exports large


@dataclass(frozen=True, eq=False)
class OrderedGrid(Prepared):
    """Page with an order that is known: all points determine its shape.

    Its picture was drawn over the grid, by no camera.
    """

    grid: GridMesh

    def unroll(self, settings: Settings, clock: Clock, on_step: OnStep | None = None) -> Unrolled:
        """The flat page; other methods than the default flatten a thinned grid."""
        count = settings.points or len(self.grid.vertices)
        if settings.method == DEFAULT:
            with clock("flatten"):
                return unroll_grid(self.grid, count)
        with clock("decimate"):
            mesh = thinned(self.grid, count)
        with clock("flatten"):
            flat = square_to_picture(flatten(mesh, settings.method, on_step=on_step))
        return Unrolled(flat, flat, np.empty((0, 2)), {})

    def camera_centre(self, fine: FlatMesh) -> None:
        """None."""


def unroll_grid(mesh: GridMesh, points: int) -> Unrolled:
    """Flatten an ordered grid by all of its points.

    Its fine mesh has up to MAX_GRID_POINTS of them.
    """
    coarse, fine = flatten_grid(mesh, points, MAX_GRID_POINTS)
    turn, centre = squaring(fine)
    coarse, fine = (replace(page, flat=(page.flat - centre) @ turn.T + centre) for page in (coarse, fine))
    return Unrolled(coarse, fine, np.empty((0, 2)), {})
