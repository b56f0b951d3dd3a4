"""Segments of CT volumes: ordered grids of points in voxels."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from restore.errors import BadInput
from restore.formats.cleaning.doubled_lines import without_doubled_lines
from restore.formats.parsing.grid import samples_in_picture
from restore.formats.parsing.source import DAMAGED
from restore.mesh.adjacency import used_vertices
from restore.mesh.ordered_grid import GridMesh, grid_faces
from restore.scan import Bytes, Floats, Mask

# A segment of a hand's breadth at a point for each voxel; the largest that are published have about as many.
MAX_SEGMENT_POINTS = 2**22
SMALLER = "export the segment with fewer points, or a part of it"


def check_segment(path: Path, rows: int, cols: int) -> None:
    """Raise BadInput for a grid of a size that no segment has.

    Less than two rows or columns, or more points than MAX_SEGMENT_POINTS.
    """
    if rows < 2 or cols < 2:
        raise BadInput(f"{path}: a grid of {rows} rows and {cols} columns is not a surface", "export the whole segment")
    if rows * cols > MAX_SEGMENT_POINTS:
        raise BadInput(f"{path} has {rows} × {cols} points, more than {MAX_SEGMENT_POINTS}", SMALLER)


def segment_mesh(
    path: Path, points: Floats, valid: Mask, texture: Bytes | None, voxel_um: float | None = None
) -> GridMesh:
    """Return the mesh of the valid points of a grid, in voxels, without lone ones.

    points: (rows, cols, 3).
    valid: (rows, cols).
    texture: (h, w, 3), of the whole grid.
    voxel_um: the edge of a voxel, where the file names it.
    Raises BadInput for a grid without a cell of three valid points.
    """
    valid = valid & np.isfinite(points).all(axis=2)
    rows, cols = valid.shape
    places_in_picture = None if texture is None else samples_in_picture(path, rows, cols, texture)
    points, valid, places_in_picture, findings = without_doubled_lines(points, valid, places_in_picture)
    faces = grid_faces(valid)
    if len(faces) == 0:
        raise BadInput(f"{path} holds no surface: no three neighbouring points are valid", DAMAGED)
    used = used_vertices(faces, int(valid.sum()))
    places = np.flatnonzero(valid)[used]
    rows, cols = valid.shape
    texcoords = None if places_in_picture is None else places_in_picture.reshape(-1, 2)[places]
    provenance: dict[str, object] = {"file": path.name, "grid": [rows, cols]}
    if voxel_um is not None:
        provenance["voxel_um"] = voxel_um
    corners = (np.cumsum(used) - 1)[faces]
    vertices = points.reshape(-1, 3)[places]
    shape, found = (rows, cols), tuple(findings)
    return GridMesh(vertices, corners, texcoords, texture, provenance, shape, places, findings=found)
