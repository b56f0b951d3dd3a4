"""Fits the sheet of a segmented range image: its part, facets and texture positions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np

from restore.camera.rays import EDGE_BLUR
from restore.numerics.limits import TINY
from restore.range_image.border import lost_border
from restore.range_image.facets.facet_model import PRECISION, WIDE_RADIUS, fit_facets
from restore.range_image.facets.sheet import WIDEST_STRIDE, Sheet, make_sheet
from restore.range_image.segmentation.segment import SegmentedScan
from restore.scan import Floats, Mask, RangeScan

MESH_PRECISION = 2e-5  # of the depth: error of linear interpolation between the vertices of a mesh, next to creases
AFFINE_SUBSET = 7  # every seventh sample determines three unknowns well enough


def fit_sheet(segmented: SegmentedScan, *, precision: float = PRECISION, cut_out: bool = False) -> Sheet:
    """Fit the sheet of a segmented scan, smooth and with filled holes.

    precision: fraction of the depth, the least standard deviation of the noise that is assumed.
    cut_out: as in Sheet.
    """
    page = _around_page(segmented)
    inverse_depth = measured_inverse_depth(page.scan.points, page.samples)
    signal, spacing = laser_signal(page.scan), abs(page.rays.dx)
    facets = fit_facets(inverse_depth, page.samples, page.inside, spacing, signal, precision=precision)
    sheet = make_sheet(page.rays, facets, page.samples, page.inside, _texture_positions(page.scan), page.scan)
    return replace(sheet, cut_out=cut_out, lost_border=lost_border(segmented))


def fit_again(
    sheet: Sheet,
    inverse_depth: Floats,
    signal: Floats | None,
    radius: int = WIDE_RADIUS,
    *,
    wide_creases: bool = False,
) -> Sheet:
    """Fit the facets of a sheet to other inverse depths (rows, cols) of its samples.

    signal (rows, cols): as `laser_signal` gives it; radius, wide_creases: as for `fit_facets`.
    """
    windows: dict[str, Any] = {"radius": radius, "wide_creases": wide_creases}
    facets = fit_facets(inverse_depth, sheet.measured, sheet.inside, abs(sheet.rays.dx), signal, **windows)
    return make_sheet(sheet.rays, facets, sheet.measured, sheet.inside, sheet.pixels, sheet.scan, radius)


def measured_inverse_depth(points: Floats, samples: Mask) -> Floats:
    """Return inverse depths (rows, cols) 1/mm of points (rows, cols, 3), NaN off samples."""
    return np.where(samples, -1.0 / np.where(samples, points[..., 2], -1.0), np.nan)


def _around_page(segmented: SegmentedScan) -> SegmentedScan:
    """Return the scan around the sheet, a cell of the lattices to every side.

    At the border of its grid the sheet ends half a sample out. The rest of the scan has no part in the page, and would
    take as long.
    """
    scan, rays, inside = segmented.scan, segmented.rays, segmented.inside
    spans = [
        np.flatnonzero(inside.any(axis=1 - axis))[[0, -1]] + (-WIDEST_STRIDE, WIDEST_STRIDE + 1) for axis in (0, 1)
    ]
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


def laser_signal(scan: RangeScan) -> Floats | None:
    """Return the red channel (rows, cols) at each sample.

    Red is the colour of the laser. Returns None for a scan without colour.
    """
    if scan.texture is None:
        return None
    positions = np.nan_to_num(scan.texture_xy, nan=-1.0).astype(np.float32)
    signal: Floats = cv2.remap(np.ascontiguousarray(scan.texture[..., 0]), positions, None, cv2.INTER_LINEAR).astype(
        np.float64
    )
    return signal


def _texture_positions(scan: RangeScan) -> Floats:
    """Return texture positions (rows, cols, 2) of all samples, pixels, partly extrapolated."""
    known = np.asarray(np.isfinite(scan.texture_xy).all(axis=2))
    row, col = (axis[::AFFINE_SUBSET] for axis in np.nonzero(known))
    design = np.column_stack([np.ones(len(row)), row, col])
    fit, *_ = np.linalg.lstsq(design, scan.texture_xy[row, col], rcond=None)
    rows, cols = np.ogrid[: known.shape[0], : known.shape[1]]
    affine = fit[0] + rows[..., None] * fit[1] + cols[..., None] * fit[2]
    # A scanner's own grid is affine; on a mesh resampled from another viewpoint the residual varies, but slowly.
    residual = np.where(known[..., None], scan.texture_xy - affine, 0.0)
    blurred_known = cv2.GaussianBlur(known.astype(np.float64), (0, 0), EDGE_BLUR)
    blurred_residual = cv2.GaussianBlur(residual, (0, 0), EDGE_BLUR) / np.maximum(blurred_known, TINY)[..., None]
    return affine + np.where(known[..., None], residual, blurred_residual)
