"""How wide a folded page is across its crease, from one edge to the other.

Two lines along a crease are as far apart on the paper everywhere. Where the shape of a gutter was not found, no patch
is, and its surface has another width in each row.
"""

from __future__ import annotations

import numpy as np

from restore.mesh.ordered_grid import grid_faces
from restore.photogrammetry.surfaces.folded import GUTTER_MM, FoldedSurface
from restore.photogrammetry.surfaces.pieces import neighbours
from restore.scan import Floats

STEP_MM = 1.0  # of the points along a row, and of the rows


def widths_across(folded: FoldedSurface) -> Floats:
    """Return the lengths (rows,) mm of a surface over the crease between two pieces.

    In rows across it, from GUTTER_MM before the crease to GUTTER_MM behind it.
    """
    ends = neighbours(folded.places)
    across = folded.labels[ends[:, 0]] != folded.labels[ends[:, 1]]
    turn = folded.pieces[0].turn
    middles = folded.places[ends[across]].mean(axis=1) @ turn.T
    x = np.median(middles[:, 0]) + np.arange(-GUTTER_MM, GUTTER_MM + STEP_MM / 2, STEP_MM)
    y = np.arange(middles[:, 1].max(), middles[:, 1].min(), -STEP_MM)
    rows = np.stack(np.meshgrid(x, y), axis=-1)
    faces = grid_faces(np.ones(rows.shape[:2], bool))
    points = folded.creased(rows.reshape(-1, 2) @ turn, faces).reshape(*rows.shape[:2], 3)
    return np.asarray(np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1))
