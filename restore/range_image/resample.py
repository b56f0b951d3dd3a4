"""Resample a dense mesh to a range grid, so that it is prepared like one."""

from __future__ import annotations

from dataclasses import replace
from math import atan2, ceil, cos, pi, radians, remainder, sin, sqrt

import numpy as np

from restore.camera.rays import Rays
from restore.mesh.measures import signed_areas, surface_area
from restore.mesh.pose import PosedSheet, pose_on_table
from restore.mesh.raster import rasterise
from restore.mesh.validate import ValidMesh, validated
from restore.numerics.limits import TINY
from restore.scan import Floats, Ints, Mask, RangeScan, SurfaceMesh

MIN_VERTICES = 30_000  # a window of seven samples is then 5 % of the page, and smooths the bends of a coarser mesh
MAX_GRID = 1000  # samples along the longer side
CAMERA_DISTANCE = 5.0  # page sizes: far enough to see between steep walls, near enough for exact arithmetic
STEEP_FRACTION = 0.05  # of the area: the steepest part, which the grid is to sample as densely as its vertices do
MIN_PITCH = 0.5  # of the vertices' spacing: on a finer grid there is little but their noise
MAX_STEEP_GRID = 500  # samples along the longer side, as many as a scanner has: the limit of refinement for steep parts
MAX_TILT = radians(3.0)  # of the page's longer side to the rows: a side along a row is known to half a sample, one that
# crosses ten of them to a twentieth
MAX_HIDDEN = 0.01  # of the area may be turned away or occluded; more, and one view does not show the surface


def resample(mesh: SurfaceMesh) -> tuple[RangeScan, Rays] | None:
    """As `view_of`, or None when the mesh is too coarse to be prepared like a scan."""
    return view_of(validated(mesh)) if len(mesh.vertices) >= MIN_VERTICES else None


def view_of(mesh: ValidMesh) -> tuple[RangeScan, Rays] | None:
    """The mesh rendered to the range grid of a pinhole camera in front of the page.

    Returns the scan, in the camera's frame, and its rays, in the frame of the mesh; or None when one view does not show
    all of it.
    """
    faces = mesh.faces
    posed = _tilted(pose_on_table(mesh.vertices, faces))
    size = float(np.ptp(posed.positions, axis=0).max())
    camera_centre = np.array([0.0, 0.0, posed.positions[:, 2].max() + CAMERA_DISTANCE * size])
    in_camera = posed.positions - camera_centre
    tangents = in_camera[:, :2] / -in_camera[:, 2:]
    spacing = sqrt(surface_area(mesh.vertices, faces) / len(mesh.vertices))
    steep = max(spacing * _foreshortening(mesh.normals, posed), size / MAX_STEEP_GRID)
    pitch = max(min(spacing, steep), size / MAX_GRID) / (CAMERA_DISTANCE * size)
    low = tangents.min(axis=0)
    cols, rows = (ceil(extent / pitch) + 1 for extent in np.ptp(tangents, axis=0))
    corners = np.stack([(tangents[:, 0] - low[0]) / pitch, rows - 1 - (tangents[:, 1] - low[1]) / pitch], axis=1)
    inverse_depth = -1.0 / in_camera[:, 2]
    texture_xy = np.zeros((len(corners), 2)) if mesh.texcoords is None else mesh.texcoords
    # Divided by depth, everything on a plane is affine over the picture: the perspective-correct interpolation.
    values = np.column_stack([inverse_depth, texture_xy * inverse_depth[:, None]])
    grid = rasterise(corners, faces, values, rows, cols, inverse_depth).astype(np.float64)
    if _hidden_fraction(corners, faces, np.isfinite(grid[..., 0])) > MAX_HIDDEN:
        return None
    row_index, col_index = np.indices((rows, cols))
    depth = 1.0 / grid[..., 0]
    x = (low[0] + pitch * col_index) * depth
    y = (low[1] + pitch * (rows - 1 - row_index)) * depth
    points, texture_xy = np.dstack([x, y, -depth]), grid[..., 1:] * depth[..., None]
    scan = RangeScan(points, mesh.texture, texture_xy, mesh.provenance, findings=mesh.findings)
    y0 = low[1] + pitch * (rows - 1)
    return scan, Rays(low[0], pitch, y0, -pitch, posed.axes, posed.origin + camera_centre @ posed.axes)


def _tilted(posed: PosedSheet) -> PosedSheet:
    """Return the sheet rotated on the table, across the rows of a view.

    Its principal axes, and with them most sides, then cross the rows.
    """
    x, y = posed.positions[:, 0], posed.positions[:, 1]
    axis = 0.5 * atan2(2.0 * float(posed.weights @ (x * y)), float(posed.weights @ (x * x - y * y)))
    angle = remainder(MAX_TILT - axis, pi / 2)  # the print stays as upright as it is
    turn = np.array([[cos(angle), -sin(angle), 0.0], [sin(angle), cos(angle), 0.0], [0.0, 0.0, 1.0]])
    return replace(posed, positions=posed.positions @ turn.T, axes=turn @ posed.axes)


def _foreshortening(normals: Floats, posed: PosedSheet) -> float:
    """Return vertex spacing in the view over that on the surface, 1 or less where steep.

    normals: (m, 3), of the faces, twice as long as their areas.
    """
    areas = np.sqrt((normals**2).sum(axis=1))
    slopes = normals @ posed.axes[2] / np.maximum(areas, TINY)
    order = np.argsort(slopes)
    steep = np.searchsorted(np.cumsum(areas[order]), STEEP_FRACTION * areas.sum())
    return float(np.clip(slopes[order[steep]], MIN_PITCH, 1.0))


def _hidden_fraction(corners: Floats, faces: Ints, covered: Mask) -> float:
    """Return the fraction of the projected area that is hidden.

    It is turned away or not in covered (rows, cols).
    corners: (n, 2), of the faces.
    """
    areas = signed_areas(corners * [1.0, -1.0], faces)
    total = float(np.abs(areas).sum())
    return max(1.0 - float(covered.sum()) / total, float(np.maximum(-areas, 0.0).sum()) / total)
