"""From a raw scan to a clean sheet: one surface, without outliers, holes or noise, its creases sharp."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from restore.errors import BadInput
from restore.mesh.clean import weld
from restore.mesh.triangulate import triangulate
from restore.mesh.validate import validated
from restore.numerics import TINY
from restore.range_image.camera import Rays, find_rays
from restore.range_image.facet_model import PRECISION, fit_facets
from restore.range_image.resample import resample
from restore.range_image.segment import find_sheet
from restore.range_image.sheet import Sheet, make_sheet
from restore.scan import Floats, Mask, RangeScan, SurfaceMesh

CONTINUED = 3.0  # samples: reaches over a drop-out
LEAST_PAGE = 5.0  # mm: a postage stamp has 20; an A3 page in metres looks like this
MARGIN = 4  # samples: one cell of the lattices
INTERPOLATED = 2e-5  # of the depth: what lies between the vertices of a mesh is known no better, beside creases
AFFINE_SUBSET = 7  # every seventh sample tells three unknowns well enough


def prepare(scan: RangeScan | SurfaceMesh) -> Sheet | SurfaceMesh:
    """The sheet on its range grid; or the mesh as it came, when no single view tells its surface.

    Raises NotEnoughSurface when the scan holds no piece of surface that could be a page, BadInput for a broken mesh.
    """
    _check_size(scan)
    if isinstance(scan, RangeScan):
        rays = find_rays(scan)
        if rays is not None:
            return smooth(scan, rays, *find_sheet(scan, rays))
        scan = triangulate(scan)
    mesh = validated(weld(validated(scan)))
    view = resample(mesh)
    return mesh if view is None else _resampled(*view)


def _check_size(scan: RangeScan | SurfaceMesh) -> None:
    points = scan.points[scan.measured] if isinstance(scan, RangeScan) else scan.vertices
    size = float(np.ptp(points, axis=0).max()) if len(points) else np.inf  # that nothing is there is told elsewhere
    if size < LEAST_PAGE:
        raise BadInput(f"the whole surface measures {size:.2g} mm", "give the coordinates in millimetres, not metres")


def smooth(scan: RangeScan, rays: Rays, samples: Mask, inside: Mask, *, precision: float = PRECISION) -> Sheet:
    """The sheet through its samples (rows, cols) on the rays of a scan, filled and without noise all over `inside`.

    precision is the least noise that is reckoned with, as a share of the depth.
    """
    scan, rays = _with_margin(scan, rays)
    samples, inside = np.pad(samples, MARGIN), np.pad(inside, MARGIN)
    inverse_depth = np.where(samples, -1.0 / np.where(samples, scan.points[..., 2], -1.0), np.nan)
    facets = fit_facets(inverse_depth, samples, inside, _red(scan), precision=precision)
    return make_sheet(rays, facets, samples, inside, _pixels(scan), scan)


def _resampled(scan: RangeScan, rays: Rays) -> Sheet:
    return smooth(scan, rays, *find_sheet(scan, rays, framed=False), precision=INTERPOLATED)


def _with_margin(scan: RangeScan, rays: Rays) -> tuple[RangeScan, Rays]:
    """The scan with an empty margin: a sheet that reaches the border of its grid still ends half a sample beyond it."""
    margin = ((MARGIN, MARGIN), (MARGIN, MARGIN), (0, 0))
    points, texture_xy = (np.pad(a, margin, constant_values=np.nan) for a in (scan.points, scan.texture_xy))
    rays = replace(rays, x0=rays.x0 - MARGIN * rays.dx, y0=rays.y0 - MARGIN * rays.dy)
    return replace(scan, points=points, texture_xy=texture_xy), rays


def _red(scan: RangeScan) -> Floats | None:
    """How bright each sample (rows, cols) is in the red of the laser, or None for a scan without colour."""
    if scan.texture is None:
        return None
    where = np.nan_to_num(scan.texture_xy, nan=-1.0).astype(np.float32)
    red: Floats = cv2.remap(np.ascontiguousarray(scan.texture[..., 0]), where, None, cv2.INTER_LINEAR).astype(
        np.float64
    )
    return red


def _pixels(scan: RangeScan) -> Floats:
    """Texture position of every grid position; where nothing was measured, continued from the samples round it."""
    known = np.asarray(np.isfinite(scan.texture_xy).all(axis=2))
    rows, cols = np.indices(known.shape)
    terms = np.stack([np.ones(known.shape), rows, cols], axis=-1)
    fit, *_ = np.linalg.lstsq(terms[known][::AFFINE_SUBSET], scan.texture_xy[known][::AFFINE_SUBSET], rcond=None)
    affine = terms @ fit
    # A scanner's own grid is affine; on a mesh seen from another side the rest varies, but slowly.
    rest = np.where(known[..., None], scan.texture_xy - affine, 0.0)
    near = cv2.GaussianBlur(known.astype(np.float64), (0, 0), CONTINUED)
    rest_near = cv2.GaussianBlur(rest, (0, 0), CONTINUED) / np.maximum(near, TINY)[..., None]
    return affine + np.where(known[..., None], rest, rest_near)
