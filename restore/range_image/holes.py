"""Holes through a sheet, where the scanner saw its table.

Behind a hole the table was measured, farther away than the paper; where ink is dark or the paper shiny nothing was, and
the sheet continues. What was measured neither on the sheet nor on the table may be another sheet or an island of this
one: that is not evidence of a hole either.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt, label

from restore.camera.rays import STEEP
from restore.mesh.adjacency import used_vertices
from restore.mesh.raster import rasterise
from restore.numerics.robust import NEVER, robust_sigma
from restore.range_image.facets.sheet import Sheet
from restore.range_image.remove_table import MIN_OF_TABLE
from restore.range_image.segmentation.segment import CLOSING_DIAMETER, SegmentedScan
from restore.scan import Floats, Mask, SurfaceMesh

MIN_SAMPLES = 6  # on the table, of one hole: two millimetres wide for a page that fills the picture
MIN_STEP_MM = 1.0  # from paper to table: a page that lies on it may have print of its colour
MIN_FRACTION = 0.3  # of a gap in the sheet: where less of it shows the table, the rest is a drop-out next to a hole


def holes_to_table(sheet: Sheet, segmented: SegmentedScan) -> Mask:
    """Return where a sheet has holes to its table.

    The table was measured through them, or is in a shadow there. A shadow of the laser in a hole is not wider than the
    table is below the paper.
    segmented: the scan that the sheet was cut out of.
    Returns (rows, cols) bool.
    """
    others = sheet.inside & sheet.scan.measured & ~sheet.measured
    if segmented.table is None or others.sum() < MIN_SAMPLES:
        return np.zeros_like(others)
    table = segmented.scan.points[segmented.table]
    return _holes(sheet, np.where(others[..., None], sheet.scan.points, np.nan), table)


def holes_to_mesh(sheet: Sheet, table: SurfaceMesh) -> Mask:
    """Return the holes (rows, cols) of a sheet before the table of its mesh.

    The sheet is shown by a view of the mesh.
    """
    rays = sheet.rays
    seen = (table.vertices - rays.origin) @ rays.axes.T
    row, col = rays.grid(table.vertices)
    places, depth = np.stack([col, row], axis=1), -seen[:, 2:]
    inverse_depth = rasterise(places, table.faces, 1.0 / depth, *sheet.inside.shape)[..., 0].astype(np.float64)
    inverse_depth[~sheet.inside | sheet.measured] = np.nan
    in_camera = replace(rays, axes=np.eye(3), origin=np.zeros(3))
    rows, cols = np.indices(sheet.inside.shape).astype(float)
    behind = in_camera.points(rows, cols, inverse_depth)
    return _holes(sheet, behind, seen[used_vertices(table.faces, len(seen))])


def _holes(sheet: Sheet, behind: Floats, table: Floats) -> Mask:
    """Return the holes (rows, cols) of a sheet that show points on a table.

    behind: (rows, cols, 3) mm.
    table: points (n, 3) mm. All are in the frame of the camera.
    """
    through = _on_table(sheet, behind, table) if len(table) >= MIN_OF_TABLE else np.zeros(sheet.inside.shape)
    gaps, count = label(sheet.inside & ~sheet.measured, np.ones((3, 3)))
    seen, size = (np.bincount(gaps[cells], minlength=count + 1) for cells in (through > 0.0, gaps > 0))
    known = (through > 0.0) & (seen >= MIN_SAMPLES)[gaps]
    if not known.any():
        return known
    distance, (row, col) = distance_transform_edt(~known, return_indices=True)
    shadowed = (gaps == gaps[row, col]) & (distance < STEEP * through[row, col])
    shadowed &= (seen > MIN_FRACTION * size)[gaps] & (gaps > 0)
    return known | _without_tails(known | shadowed, known)


def _without_tails(hole: Mask, known: Mask) -> Mask:
    """Return the broad parts of a hole that have cells known to be one.

    Drop-outs are attached to it by a few samples. Returns (rows, cols) bool.
    """
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (CLOSING_DIAMETER, CLOSING_DIAMETER))
    broad = cv2.morphologyEx(hole.astype(np.uint8), cv2.MORPH_OPEN, kernel)
    parts, _ = label(broad)
    return np.isin(parts, np.unique(parts[known & (broad > 0)])) & (broad > 0)


def _on_table(sheet: Sheet, behind: Floats, table: Floats) -> Floats:
    """Return how many samples below the paper the table is, (rows, cols), 0 if unknown."""
    design, found = _design(table), -1.0 / table[:, 2]
    plane, *_ = np.linalg.lstsq(design, found, rcond=None)
    paper, of_table, own = sheet.planes[..., 0], _design(behind) @ plane, -1.0 / behind[..., 2]
    step = paper - of_table
    least = np.maximum(MIN_STEP_MM * paper * of_table, NEVER * robust_sigma(found - design @ plane))
    on_table = (step > least) & (np.abs(own - of_table) < np.minimum(0.5 * step, least))
    return np.where(on_table, step / (of_table * abs(sheet.rays.dx)), 0.0)


def _design(points: Floats) -> Floats:
    """Return the terms (…, 3) in which inverse depth on a plane is linear.

    points: (…, 3) mm, in the frame of the camera.
    """
    return points / -points[..., 2:]
