"""Prepare a raw scan: one surface without outliers, holes or noise, its creases kept sharp."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from restore.camera.rays import find_rays
from restore.mesh.clean import large_pieces, select, weld
from restore.mesh.ordered_grid import GridMesh
from restore.mesh.triangulate import triangulate
from restore.mesh.validate import validated
from restore.prepared.size import check_size
from restore.range_image.border import turned_border
from restore.range_image.facets.sheet import Sheet
from restore.range_image.fit_sheet import MESH_PRECISION, fit_sheet
from restore.range_image.holes import holes_to_mesh, holes_to_table
from restore.range_image.remove_table import page_and_table
from restore.range_image.resample import resample
from restore.range_image.segmentation.segment import SegmentedScan, find_sheet, largest_surface, segment
from restore.scan import InterpolatedMesh, RangeScan, SurfaceMesh
from restore.scan_check import refuse_unusable


def prepare(scan: RangeScan | SurfaceMesh | SegmentedScan) -> Sheet | SurfaceMesh:
    """The sheet on its range grid; the validated mesh, when no single view shows all of it; an ordered grid as it is.

    Raises NotEnoughSurface when the scan holds no piece of surface that could be a page, BadInput for a broken one.
    """
    if isinstance(scan, GridMesh):
        return scan
    if isinstance(scan, SegmentedScan):
        check_size(scan.scan)
        return _with_holes(scan)
    refuse_unusable(scan)
    if isinstance(scan, RangeScan):
        check_size(scan)
        rays = find_rays(scan)
        if rays is not None:
            return _with_holes(find_sheet(scan, rays))
        scan = triangulate(scan)
    return _prepare_mesh(scan)


def _prepare_mesh(scan: SurfaceMesh) -> Sheet | SurfaceMesh:
    """A mesh, without its table, as one view shows it; a mesh still where none shows all of it, or it is coarse."""
    mesh = validated(scan)
    check_size(mesh)
    mesh = validated(weld(mesh))
    alone = isinstance(scan, InterpolatedMesh)  # of the page: a flat part of it, lit otherwise, is no table
    page, table = (mesh, None) if alone else page_and_table(mesh)
    view = resample(page)
    if view is not None:
        sheet = segment(*view, view[0].measured) if alone else largest_surface(*view, view[0].measured)
        fitted = fit_sheet(sheet, precision=MESH_PRECISION, cut_out=not alone)
        return fitted if table is None else replace(fitted, holes=holes_to_mesh(fitted, table))
    return mesh if page is mesh else select(page, page.faces[max(large_pieces(page), key=np.count_nonzero)])


def _with_holes(segmented: SegmentedScan) -> Sheet:
    """The sheet of a scanner's own picture, with the holes through it, and how much of its border may go on unseen."""
    sheet = fit_sheet(segmented)
    holes = holes_to_table(sheet, segmented)
    return replace(sheet, holes=holes, cut=segmented.cut, turned_border=turned_border(sheet))
