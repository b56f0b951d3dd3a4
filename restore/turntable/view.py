"""One view of a turntable, and the surface of another rendered along its rays."""

from __future__ import annotations

import cv2
import numpy as np

from restore.camera.rays import MAX_SLOPE, find_rays
from restore.errors import BadInput, NotEnoughSurface
from restore.mesh.measures import signed_areas
from restore.mesh.raster import rasterise
from restore.mesh.triangulate import triangulate
from restore.numerics.limits import TINY
from restore.range_image.segmentation.segment import find_sheet
from restore.scan import Floats, RangeScan

OFFSET_BLUR = 12.0  # samples: Gaussian σ over which the offset between two views is averaged


class RangeView:
    """One view of a turntable: its scan, its rays and its mesh.

    inverse_depth  (rows, cols) 1/mm, NaN where nothing was measured.
    spacing        mm between samples.
    Raises BadInput when it is not one shot of a scanner, NotEnoughSurface when it is empty.
    """

    def __init__(self, scan: RangeScan) -> None:
        rays = find_rays(scan)
        if rays is None:
            raise BadInput(
                "a view is not one capture of a scanner", "merge the scan folders that the scanner's captures left"
            )
        self.scan, self.rays = scan, rays
        self.inverse_depth = np.where(scan.measured, -1.0 / scan.points[..., 2], np.nan)
        self.spacing = float(rays.dx / np.nanmedian(self.inverse_depth))
        mesh = triangulate(scan)
        depth = -mesh.vertices[mesh.faces][..., 2]
        connected = np.ptp(depth, axis=1) < MAX_SLOPE * rays.dx * depth.min(axis=1)
        self._vertices, self._faces = mesh.vertices, mesh.faces[connected]

    def render_inverse_depth(self, other: RangeView, motion: Floats) -> Floats:
        """Return another view's inverse depth along this view's rays.

        motion: (4, 4), rigid motion from the other's frame to that of this view.
        Returns (rows, cols) 1/mm, NaN outside its surface.
        """
        points = other._vertices @ motion[:3, :3].T + motion[:3, 3]
        rows, cols = self.rays.grid(points)
        corners = np.column_stack([cols, rows])
        faces = other._faces[signed_areas(corners * [1.0, -1.0], other._faces) > 0]  # without back faces
        inverse_depth = -1.0 / points[:, 2]
        shape = self.inverse_depth.shape
        return np.asarray(
            rasterise(corners, faces, inverse_depth[:, None], shape[0], shape[1], inverse_depth)[..., 0], np.float64
        )

    def surface_distance(self, layer: Floats) -> Floats:
        """Return the signed distance (n,) mm to a layer along the normal, at n common samples.

        layer: (rows, cols) 1/mm.
        """
        across, down = (np.gradient(self.scan.points, axis=axis) for axis in (1, 0))
        normal = np.cross(down, across)
        directions = self.scan.points / np.linalg.norm(self.scan.points, axis=2, keepdims=True)
        cosine = np.abs((normal * directions).sum(axis=2)) / np.linalg.norm(normal, axis=2)
        surface_distance = (1.0 / layer - 1.0 / self.inverse_depth) * cosine
        return np.asarray(surface_distance[np.isfinite(surface_distance)])

    def subtract_offset(self, layer: Floats) -> Floats:
        """Return a layer minus its local mean offset from this view.

        Holes are filled without steps that way. The offset is averaged over the samples nearby at which both show the
        same surface.
        layer: (rows, cols) 1/mm, as returned.
        """
        with np.errstate(invalid="ignore"):
            # Farther apart along the ray, two views show different surfaces.
            shared = np.abs(1.0 / layer - 1.0 / self.inverse_depth) < MAX_SLOPE * self.spacing
        blurred_shared = cv2.GaussianBlur(shared.astype(np.float64), (0, 0), OFFSET_BLUR)
        mean = cv2.GaussianBlur(np.where(shared, layer - self.inverse_depth, 0.0), (0, 0), OFFSET_BLUR)
        return np.asarray(layer - mean / np.maximum(blurred_shared, TINY))

    def count_fillable(self, layer: Floats) -> int:
        """The number of samples that the layer (rows, cols) has and this view lacks."""
        return int((np.isnan(self.inverse_depth) & np.isfinite(layer)).sum())

    def sheet_samples(self) -> int:
        """Return the number of samples of the sheet, 0 without one or where it is cut off."""
        try:
            samples = find_sheet(self.scan, self.rays).samples
        except NotEnoughSurface:
            return 0
        cut_off = any(side.any() for side in (samples[0], samples[-1], samples[:, 0], samples[:, -1]))
        return 0 if cut_off else int(samples.sum())

    def fill_holes(self, layers: list[Floats]) -> Floats:
        """Fill this view's holes with the nearest surface along each ray.

        Where several layers have that surface, their mean. Returns (rows, cols, 3) mm.
        """
        stack = np.stack([np.full_like(self.inverse_depth, np.nan), *layers])
        known = np.isfinite(stack)
        nearest = np.where(known, stack, -np.inf).max(axis=0)
        with np.errstate(invalid="ignore"):
            same_surface = known & (1.0 / stack - 1.0 / nearest < MAX_SLOPE * self.spacing)
        count = same_surface.sum(axis=0)
        mean = np.where(same_surface, stack, 0.0).sum(axis=0) / np.maximum(count, 1)
        hole = np.isnan(self.inverse_depth)
        index = np.indices(hole.shape, dtype=np.float64)
        points = self.rays.points(index[0], index[1], np.where(count > 0, mean, np.nan))
        return np.where(hole[..., None], points, self.scan.points)
