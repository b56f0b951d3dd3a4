"""Prepare a raw scan: one surface without outliers, holes or noise, its creases kept sharp."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np

from restore.errors import BadInput
from restore.formats.source import MAX_COORDINATE_MM
from restore.formats.unit import GIVEN, UNIT_MM, UNSTATED
from restore.mesh.adjacency import used_vertices
from restore.mesh.clean import large_pieces, select, weld, without_debris
from restore.mesh.non_manifold import without_fins
from restore.mesh.ordered_grid import GridMesh
from restore.mesh.orient import map_runs_back
from restore.mesh.triangulate import triangulate
from restore.mesh.validate import validated
from restore.numerics import TINY
from restore.range_image.camera import find_rays
from restore.range_image.facet_model import PRECISION, fit_facets
from restore.range_image.holes import holes_to_mesh, holes_to_table
from restore.range_image.lost_border import lost_border
from restore.range_image.off_table import page_and_table
from restore.range_image.resample import resample
from restore.range_image.segment import SegmentedScan, find_sheet, largest_surface, segment
from restore.range_image.sheet import Sheet, make_sheet
from restore.range_image.turned_border import turned_border
from restore.scan import Floats, InterpolatedMesh, RangeScan, SurfaceMesh, with_warnings
from restore.scan_check import refuse_unusable

EXTRAPOLATION_BLUR = 3.0  # samples: Gaussian σ, wider than a drop-out
MIN_PAGE_MM = 20.0  # mm of the longest side: a postage stamp has 24, an A3 page in inches 16.5
MAX_PAGE_MM = 10_000.0  # mm: four times what the scanner sees; a Letter page in inches, read as metres, has 11,000
MIN_SIDE_MM = 1.0  # mm, whatever the unit: less than two samples of the scanner at its nearest
FAR = 10.0  # of its size from the origin, and farther than any scanner sees: coordinates of a map, not of a page
MARGIN = 4  # samples: one cell of the lattices
MESH_PRECISION = 2e-5  # of the depth: error of the linear interpolation between the vertices of a mesh, beside creases
AFFINE_SUBSET = 7  # every seventh sample determines three unknowns well enough


def prepare(scan: RangeScan | SurfaceMesh | SegmentedScan) -> Sheet | SurfaceMesh:
    """The sheet on its range grid; the validated mesh, when no single view shows all of it; an ordered grid as it is.

    Raises NotEnoughSurface when the scan holds no piece of surface that could be a page, BadInput for a broken one.
    """
    if isinstance(scan, GridMesh):
        return scan
    if isinstance(scan, SegmentedScan):
        _check_size(scan.scan)
        return _with_holes(scan)
    refuse_unusable(scan)
    if isinstance(scan, RangeScan):
        _check_size(scan)
        rays = find_rays(scan)
        if rays is not None:
            return _with_holes(find_sheet(scan, rays))
        scan = triangulate(scan)
    return _prepare_mesh(scan)


def _prepare_mesh(scan: SurfaceMesh) -> Sheet | SurfaceMesh:
    """A mesh, without its table, as one view shows it; a mesh still where none shows all of it, or it is coarse."""
    mesh = validated(scan)
    _check_size(mesh)
    mesh, cut = without_fins(validated(weld(mesh)))
    mesh, debris = without_debris(mesh)
    warnings = [*cut, *debris]
    alone = isinstance(scan, InterpolatedMesh)  # of the page: a flat part of it, lit otherwise, is no table
    mirrored = not alone and scan.texcoords is not None and map_runs_back(scan.faces, scan.texcoords)
    if warnings or mirrored:
        facts = with_warnings(mesh.provenance, *warnings) | ({"mirrored": True} if mirrored else {})
        mesh = replace(mesh, provenance=facts)
    page, table = (mesh, None) if alone else page_and_table(mesh)
    view = resample(page)
    if view is not None:
        sheet = segment(*view, view[0].measured) if alone else largest_surface(*view, view[0].measured)
        fitted = fit_sheet(sheet, precision=MESH_PRECISION, cut_out=not alone)
        return fitted if table is None else replace(fitted, holes=holes_to_mesh(fitted, table))
    return mesh if page is mesh else select(page, page.faces[max(large_pieces(page), key=len)])


def _with_holes(segmented: SegmentedScan) -> Sheet:
    """The sheet of a scanner's own picture, with the holes through it, and how much of its border may go on unseen."""
    sheet = fit_sheet(segmented)
    holes = holes_to_table(sheet, segmented)
    return replace(sheet, holes=holes, cut=segmented.cut, turned_border=turned_border(sheet))


def _check_size(scan: RangeScan | SurfaceMesh) -> None:
    """Raise BadInput for a size that no page has, unless the unit was given, and for a surface far from its origin."""
    if isinstance(scan, RangeScan):
        points = scan.points[scan.measured]
    else:
        points = scan.vertices[used_vertices(scan.faces, len(scan.vertices))]
    if len(points) == 0:  # reported elsewhere
        return
    low, high = np.array([(axis.min(), axis.max()) for axis in points.T]).T  # axis by axis it takes a third of the time
    far = float(max(-low.min(), high.max()))
    if far > MAX_COORDINATE_MM and far > FAR * float((high - low).max()):
        raise BadInput(
            f"the surface lies {far / 1e6:.3g} km from the origin of its coordinates, too far to be exact",
            "subtract its middle from all its points: map coordinates, say, are such",
        )
    long, wide = np.sort(high - low)[:0:-1]
    given = scan.provenance.get("unit_source") == GIVEN
    least, most = (MIN_SIDE_MM, np.inf) if given else (MIN_PAGE_MM, MAX_PAGE_MM)
    if not least <= long <= most:
        unit = str(scan.provenance.get("unit", UNSTATED))
        raise BadInput(
            f"the whole surface measures {_metric(long)} × {_metric(wide)}: is {unit} its unit?",
            _other_units(long, unit),
        )


def _other_units(size: float, unit: str) -> str:
    """The remedy for a surface of size mm that was read in a unit: the units that would make a page of it."""
    sizes = {name: size * factor / UNIT_MM.get(unit, 1.0) for name, factor in UNIT_MM.items()}
    pages = [f"{name} ({_metric(mm)})" for name, mm in sizes.items() if MIN_PAGE_MM <= mm <= MAX_PAGE_MM]
    which = f", which can be {', '.join(pages)}" if pages else ""
    return f"give the unit of the file with --unit{which}; without a file, the coordinates in millimetres"


def _metric(size: float) -> str:
    return f"{size:.3g} mm" if size < 1000.0 else f"{size / 1000:.3g} m"


def fit_sheet(segmented: SegmentedScan, *, precision: float = PRECISION, cut_out: bool = False) -> Sheet:
    """The sheet of a segmented scan, smoothed and with its holes filled.

    precision is the least standard deviation of the noise that is assumed, as a share of the depth; cut_out as in
    Sheet.
    """
    page = _around_page(segmented)
    inverse_depth = np.where(page.samples, -1.0 / np.where(page.samples, page.scan.points[..., 2], -1.0), np.nan)
    signal, spacing = _laser_signal(page.scan), abs(page.rays.dx)
    facets = fit_facets(inverse_depth, page.samples, page.inside, spacing, signal, precision=precision)
    sheet = make_sheet(page.rays, facets, page.samples, page.inside, _texture_positions(page.scan), page.scan)
    return replace(sheet, cut_out=cut_out, lost_border=lost_border(segmented))


def _around_page(segmented: SegmentedScan) -> SegmentedScan:
    """What lies round the sheet, MARGIN samples to every side: at the border of its grid it ends half a sample out.

    The rest of the scan has no part in the page, and would take as long.
    """
    scan, rays, inside = segmented.scan, segmented.rays, segmented.inside
    spans = [np.flatnonzero(inside.any(axis=1 - axis))[[0, -1]] + (-MARGIN, MARGIN + 1) for axis in (0, 1)]
    window = tuple(slice(max(first, 0), last) for first, last in spans)
    beyond = [(max(-first, 0), max(last - size, 0)) for (first, last), size in zip(spans, inside.shape, strict=True)]

    def cut(values: Any, empty: Any) -> Any:
        return np.pad(values[window], beyond + [(0, 0)] * (values.ndim - 2), constant_values=empty)

    (down, _), (right, _) = spans
    return SegmentedScan(
        replace(scan, points=cut(scan.points, np.nan), texture_xy=cut(scan.texture_xy, np.nan)),
        replace(rays, x0=rays.x0 + right * rays.dx, y0=rays.y0 + down * rays.dy),
        cut(segmented.samples, False),
        cut(inside, False),
    )


def _laser_signal(scan: RangeScan) -> Floats | None:
    """(rows, cols) red channel at each sample, the colour of the laser, or None for a scan without colour."""
    if scan.texture is None:
        return None
    positions = np.nan_to_num(scan.texture_xy, nan=-1.0).astype(np.float32)
    signal: Floats = cv2.remap(np.ascontiguousarray(scan.texture[..., 0]), positions, None, cv2.INTER_LINEAR).astype(
        np.float64
    )
    return signal


def _texture_positions(scan: RangeScan) -> Floats:
    """(rows, cols, 2) texture position, pixels, of every sample, extrapolated where not measured."""
    known = np.asarray(np.isfinite(scan.texture_xy).all(axis=2))
    row, col = (axis[::AFFINE_SUBSET] for axis in np.nonzero(known))
    design = np.column_stack([np.ones(len(row)), row, col])
    fit, *_ = np.linalg.lstsq(design, scan.texture_xy[row, col], rcond=None)
    rows, cols = np.ogrid[: known.shape[0], : known.shape[1]]
    affine = fit[0] + rows[..., None] * fit[1] + cols[..., None] * fit[2]
    # A scanner's own grid is affine; on a mesh resampled from another viewpoint the residual varies, but slowly.
    residual = np.where(known[..., None], scan.texture_xy - affine, 0.0)
    blurred_known = cv2.GaussianBlur(known.astype(np.float64), (0, 0), EXTRAPOLATION_BLUR)
    blurred_residual = (
        cv2.GaussianBlur(residual, (0, 0), EXTRAPOLATION_BLUR) / np.maximum(blurred_known, TINY)[..., None]
    )
    return affine + np.where(known[..., None], residual, blurred_residual)
