"""The page of an ordered grid, such as a segment of a CT volume."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from restore.flattening.ordered_grid import flatten_grid
from restore.mesh.ordered_grid import GridMesh
from restore.prepared.prepared import Unrolled, squaring

MAX_GRID_POINTS = 250_000  # of an ordered grid: ten times its nodes tell their strain, and more make exports large


def unroll_grid(mesh: GridMesh, points: int) -> Unrolled:
    """The page of an ordered grid, flattened by all of its points: its fine mesh has up to MAX_GRID_POINTS of them."""
    coarse, fine = flatten_grid(mesh, points, MAX_GRID_POINTS)
    turn, centre = squaring(fine)
    coarse, fine = (replace(page, flat=(page.flat - centre) @ turn.T + centre) for page in (coarse, fine))
    return Unrolled(coarse, fine, np.empty((0, 2)), {})
