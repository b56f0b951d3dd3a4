"""Prepares a raw scan for flattening: no outliers, holes or noise, creases kept sharp."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from restore.camera.rays import find_rays
from restore.mesh.clean import large_pieces, select, weld, without_debris
from restore.mesh.non_manifold import without_fins
from restore.mesh.ordered_grid import GridMesh
from restore.mesh.orient import map_runs_back
from restore.mesh.page_below import without_page_below
from restore.mesh.triangulate import triangulate
from restore.mesh.validate import ValidMesh, validated
from restore.outline.unmeasured import unmeasured_border
from restore.prepared.facet_sheet import FacetSheet
from restore.prepared.leaf_sheet import leaf_of
from restore.prepared.ordered_grid import OrderedGrid
from restore.prepared.plain_mesh import InterpolatedPage, PlainMesh
from restore.prepared.prepared import Prepared
from restore.prepared.separate import SeparateSheet
from restore.prepared.size import check_size
from restore.range_image.border import turned_border
from restore.range_image.fit_sheet import MESH_PRECISION, fit_sheet
from restore.range_image.holes import holes_to_mesh, holes_to_table
from restore.range_image.remove_table import page_and_table
from restore.range_image.resample import resample
from restore.range_image.segmentation.segment import SegmentedScan, find_sheet, largest_surface, segment
from restore.runtime.results import Kept
from restore.scan import InterpolatedMesh, RangeScan, ScannedSheet, SurfaceMesh, with_findings
from restore.scan_check import refuse_unusable_image, refuse_unusable_mesh


def prepare(scan: RangeScan | SurfaceMesh | ScannedSheet, kept: Kept | None = None) -> Prepared:
    """Prepare a scan's page on its range grid, as a mesh without one, or as ordered grid.

    Raises NotEnoughSurface when no piece of surface in the scan could be a page, BadInput for a damaged scan.
    """
    if isinstance(scan, SeparateSheet):
        return of_sheet(scan, kept)
    return PREPARERS[next(kind for kind in type(scan).__mro__ if kind in PREPARERS)](scan)


def of_range_image(scan: RangeScan) -> Prepared:
    """Prepare a picture's largest sheet, as a mesh where samples are on no lines of sight."""
    refuse_unusable_image(scan)
    check_size(scan)
    rays = find_rays(scan)
    if rays is not None:
        return of_segmented(find_sheet(scan, rays))
    prepared = of_mesh(triangulate(scan))
    return replace(prepared, is_one_shot=True)


def of_segmented(segmented: SegmentedScan) -> FacetSheet:
    """Prepare the sheet of a scanner's own picture, with its holes and unseen border."""
    check_size(segmented.scan)
    sheet = fit_sheet(segmented)
    holes = holes_to_table(sheet, segmented)
    lost = max(sheet.lost_border, unmeasured_border(sheet))
    sheet = replace(sheet, holes=holes, cut=segmented.cut, lost_border=lost, turned_border=turned_border(sheet))
    return FacetSheet(sheet, is_one_shot=True)


def of_sheet(sheet: SeparateSheet, kept: Kept | None) -> Prepared:
    """Prepare a sheet of a scan.

    What was found of it in its range image need not be looked for again.
    """
    if sheet.prepared is not None:
        return sheet.prepared
    if sheet.segmented is None:
        return prepare(sheet.scan)
    prepared = of_view if sheet.of_mesh else of_segmented
    whole = kept.result(prepared, sheet.segmented) if kept is not None else prepared(sheet.segmented)
    rays = sheet.segmented.rays
    if sheet.erased is not None:
        whole = replace(whole, erased=whole.on_own_grid(rays, sheet.erased))
    return whole if sheet.spine is None else leaf_of(whole, rays, sheet.spine, sheet.part)


def of_mesh(scan: SurfaceMesh) -> FacetSheet | PlainMesh:
    """Prepare a mesh, without its table, as one view shows it.

    It stays a mesh where no view shows all of it, or it is coarse.
    """
    refuse_unusable_mesh(scan)
    mesh = _checked(scan)
    if scan.texcoords is not None and map_runs_back(scan.faces, scan.texcoords):
        mesh = replace(mesh, provenance={**mesh.provenance, "mirrored": True})
    page, table = page_and_table(mesh)
    page, below = without_page_below(page)
    page = with_findings(page, *below)
    view = resample(page)
    if view is None:
        alone = page if table is None else select(page, page.faces[max(large_pieces(page), key=len)])
        return PlainMesh(alone)
    seen = of_view(largest_surface(*view, view[0].measured))
    return seen if table is None else replace(seen, sheet=replace(seen.sheet, holes=holes_to_mesh(seen.sheet, table)))


def of_view(view: SegmentedScan) -> FacetSheet:
    """Prepare the sheet of a view of a mesh.

    Its points are without a scanner's noise and end where the mesh was cut.
    """
    return FacetSheet(fit_sheet(view, precision=MESH_PRECISION, cut_out=True))


def of_interpolated(scan: InterpolatedMesh) -> InterpolatedPage:
    """A mesh of the page alone: a flat part of it, lit otherwise, is not a table."""
    refuse_unusable_mesh(scan)
    mesh = _checked(scan)
    view = resample(mesh)
    if view is None:
        return InterpolatedPage(PlainMesh(mesh), scan)
    sheet = fit_sheet(segment(*view, view[0].measured), precision=MESH_PRECISION)
    return InterpolatedPage(FacetSheet(sheet), scan)


def _checked(scan: SurfaceMesh) -> ValidMesh:
    """The valid mesh of a page's size: its seams joined, fins and debris left out."""
    mesh = validated(scan)
    check_size(mesh)
    mesh, cut = without_fins(validated(weld(mesh)))
    mesh, debris = without_debris(mesh)
    return with_findings(mesh, *cut, *debris)


PREPARERS: Mapping[type, Callable[[Any], Prepared]] = {
    RangeScan: of_range_image,
    SurfaceMesh: of_mesh,
    InterpolatedMesh: of_interpolated,
    GridMesh: OrderedGrid,
}
"""Kind of scan → what prepares it.

A kind that is not listed is prepared as the nearest that it derives from.
"""
