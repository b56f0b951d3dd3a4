"""Cut what lies on a table out of a mesh that shows the table, too.

Between page and table there is a step in depth. A range image has no samples there, a mesh has faces that bridge it.
"""

from __future__ import annotations

import numpy as np

from restore.camera.rays import MAX_SLOPE, STEEP, Rays
from restore.mesh.adjacency import piece_of_faces
from restore.mesh.clean import select
from restore.mesh.validate import ValidMesh, validated
from restore.numerics.robust import MAJORITY, OUTLYING, robust_sigma
from restore.range_image.resample import view_of
from restore.range_image.segmentation.segment import inverse_depths
from restore.range_image.segmentation.surface import BORDER_BAND
from restore.range_image.segmentation.table import find_table
from restore.scan import Floats, Ints, Mask, RangeScan, SurfaceMesh
from restore.vivid import WRITTEN_MM

HANGS = 0.25  # of the height of its highest vertex: the lowest of a face that hangs from the page to the table
MIN_VIEW = 4 * BORDER_BAND  # samples a side: the border where a table is looked for is three quarters of it
MIN_OF_TABLE = 3  # vertices or samples that determine its plane


def remove_table(mesh: ValidMesh) -> ValidMesh:
    """Return a mesh without its table and the faces of the step to it.

    The mesh itself where its view shows no table.
    """
    return page_and_table(mesh)[0]


def page_and_table(mesh: ValidMesh) -> tuple[ValidMesh, SurfaceMesh | None]:
    """Return a mesh without its table and the step to it, and the table.

    The step consists of the faces that bridge it. Of the faces next to these, those steeper than MAX_SLOPE are removed,
    too, and those that reach down to a vertex just off the plane: a step may have vertices half-way, from samples that
    mix both depths. A mesh of which no single view shows all, or without a table, is returned as it is, with None.
    """
    view = view_of(mesh)
    if view is None or min(view[0].points.shape[:2]) < MIN_VIEW:
        return mesh, None
    scan, rays = view
    table = find_table(scan, inverse_depths(scan), scan.measured, framed=False).samples
    over = (mesh.vertices - rays.origin) @ rays.axes.T
    of_table = _shown_by(table, mesh.vertices, over[:, 2], scan, rays)
    if of_table.sum() < MIN_OF_TABLE:
        return mesh, None
    design = np.column_stack([over[:, :2], np.ones(len(over))])
    plane, *_ = np.linalg.lstsq(design[of_table], over[of_table, 2], rcond=None)
    height = over[:, 2] - design @ plane
    in_plane = np.abs(height) < OUTLYING * max(robust_sigma(height[of_table]), WRITTEN_MM)
    slope = _slopes(mesh, np.array([-plane[0], -plane[1], 1.0]) @ rays.axes)
    touches = in_plane[mesh.faces].any(axis=1)
    gone = (of_table & in_plane)[mesh.faces].any(axis=1) | (touches & (slope > STEEP))
    heights = height[mesh.faces]
    hangs = (slope > STEEP) & (heights.min(axis=1) < HANGS * heights.max(axis=1))
    gone |= (hangs | (slope > MAX_SLOPE)) & np.isin(mesh.faces, mesh.faces[gone]).any(axis=1)
    if gone.all() or not _is_step(mesh, mesh.faces[~gone], gone & touches, slope):
        return mesh, None
    lying = (of_table & in_plane)[mesh.faces].all(axis=1)
    return validated(select(mesh, mesh.faces[~gone])), SurfaceMesh(mesh.vertices, mesh.faces[lying])


def _is_step(mesh: ValidMesh, kept: Ints, left_out: Mask, slope: Floats) -> bool:
    """Return whether a step or a gap bounds the kept piece.

    It separates the largest piece of the faces that are kept (k, 3) from those left out (m,). A frame that is printed
    round a page is flat and has its own colour, too, but the page continues from it without a step.
    slope: (m,), of all faces.
    """
    piece = piece_of_faces(kept)
    page = kept[piece == np.bincount(piece).argmax()]
    rim = left_out & np.isin(mesh.faces, page).any(axis=1)
    # Between page and table all faces are steep but where the page touches it; none is within a page.
    return not rim.any() or float((slope[rim] > STEEP).mean()) > MAJORITY


def _shown_by(chosen: Mask, vertices: Floats, up: Floats, scan: RangeScan, rays: Rays) -> Mask:
    """Return the vertices that chosen samples of a scan show.

    vertices: (n, 3) mm.
    up: (n,) mm, from the camera.
    chosen: (rows, cols).
    Returns (n,) bool.
    """
    row, col = (
        np.clip(np.rint(place).astype(int), 0, size - 1)
        for place, size in zip(rays.grid(vertices), chosen.shape, strict=True)
    )
    depth = scan.points[row, col, 2]
    return np.asarray(chosen[row, col] & (np.abs(up - depth) < -depth * rays.dx))


def _slopes(mesh: ValidMesh, up: Floats) -> Floats:
    """Return the slopes (m,) of the faces from a plane, as tangents.

    up: (3,), normal of the plane. Infinite where a face is turned away.
    """
    rise = mesh.normals @ (up / np.linalg.norm(up))
    aside = np.sqrt(np.maximum((mesh.normals**2).sum(axis=1) - rise**2, 0.0))
    return np.divide(aside, rise, out=np.full(len(rise), np.inf), where=rise > 0.0)
