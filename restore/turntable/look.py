"""Look at the surface of one view along the rays of another."""

from __future__ import annotations

import cv2
import numpy as np

from restore.errors import BadInput, NotEnoughSurface
from restore.mesh.measures import signed_areas
from restore.mesh.raster import rasterise
from restore.mesh.triangulate import triangulate
from restore.numerics import TINY
from restore.range_image.camera import find_rays
from restore.range_image.segment import find_sheet
from restore.scan import Floats, RangeScan

MAX_SLOPE = 6.0  # 80.5°: a steeper face spans the step from one surface to another
SAME_SURFACE = 6.0  # samples along the ray: farther apart, two views see different surfaces
DRAWN = 12.0  # samples round a hole over which a view is drawn to the one that has it


class Outlook:
    """One view with what is needed to look at it, and along its rays.

    inverse  (rows, cols) 1/D, NaN where nothing was measured.
    spacing  mm between samples.
    Raises BadInput when it is not one shot of a scanner, NotEnoughSurface when it is empty.
    """

    def __init__(self, scan: RangeScan) -> None:
        rays = find_rays(scan)
        if rays is None:
            raise BadInput(
                "a view is not one shot of a scanner", "merge the scan folders that the scanner's shots left"
            )
        self.scan, self.rays = scan, rays
        self.inverse = np.where(scan.measured, -1.0 / scan.points[..., 2], np.nan)
        self.spacing = float(rays.dx / np.nanmedian(self.inverse))
        mesh = triangulate(scan)
        depth = -mesh.vertices[mesh.faces][..., 2]
        whole = np.ptp(depth, axis=1) < MAX_SLOPE * rays.dx * depth.min(axis=1)
        self._vertices, self._faces = mesh.vertices, mesh.faces[whole]

    def at(self, other: Outlook, motion: Floats) -> Floats:
        """(rows, cols) 1/D of the other's surface along these rays, NaN where they miss it.

        motion  (4, 4), takes the other's points to this view's frame.
        """
        points = other._vertices @ motion[:3, :3].T + motion[:3, 3]
        rows, cols = self.rays.grid(points)
        corners = np.column_stack([cols, rows])
        faces = other._faces[signed_areas(corners * [1.0, -1.0], other._faces) > 0]  # the rest is turned away
        inverse = -1.0 / points[:, 2]
        shape = self.inverse.shape
        return np.asarray(rasterise(corners, faces, inverse[:, None], *shape, inverse)[..., 0], np.float64)

    def apart(self, layer: Floats) -> Floats:
        """(n,) mm between this surface and a layer, along the normal, at the samples that both have."""
        right, down = (np.gradient(self.scan.points, axis=axis) for axis in (1, 0))
        normal = np.cross(down, right)
        sight = self.scan.points / np.linalg.norm(self.scan.points, axis=2, keepdims=True)
        facing = np.abs((normal * sight).sum(axis=2)) / np.linalg.norm(normal, axis=2)
        apart = (1.0 / layer - 1.0 / self.inverse) * facing
        return np.asarray(apart[np.isfinite(apart)])

    def drawn(self, layer: Floats) -> Floats:
        """The layer without what it is off, on average, where both see the same surface nearby.

        So a hole is filled without a step at its rim.
        """
        with np.errstate(invalid="ignore"):
            shared = np.abs(1.0 / layer - 1.0 / self.inverse) < SAME_SURFACE * self.spacing
        near = cv2.GaussianBlur(shared.astype(np.float64), (0, 0), DRAWN)
        mean = cv2.GaussianBlur(np.where(shared, layer - self.inverse, 0.0), (0, 0), DRAWN)
        return np.asarray(layer - mean / np.maximum(near, TINY))

    def holes(self, layer: Floats) -> int:
        """How many samples the layer has that this view has not."""
        return int((np.isnan(self.inverse) & np.isfinite(layer)).sum())

    def sheet(self) -> int:
        """Samples of the largest connected surface; 0 when none could be a page, or it runs out of the picture."""
        try:
            samples, _ = find_sheet(self.scan, self.rays)
        except NotEnoughSurface:
            return 0
        cut_off = any(side.any() for side in (samples[0], samples[-1], samples[:, 0], samples[:, -1]))
        return 0 if cut_off else int(samples.sum())

    def filled(self, layers: list[Floats]) -> Floats:
        """(rows, cols, 3) mm: this view's points, and where it has none, the surface that its rays meet first.

        Where several layers have that surface, their mean.
        """
        stack = np.stack([np.full_like(self.inverse, np.nan), *layers])
        seen = np.isfinite(stack)
        first = np.where(seen, stack, -np.inf).max(axis=0)
        with np.errstate(invalid="ignore"):
            same = seen & (1.0 / stack - 1.0 / first < SAME_SURFACE * self.spacing)
        count = same.sum(axis=0)
        mean = np.where(same, stack, 0.0).sum(axis=0) / np.maximum(count, 1)
        hole = np.isnan(self.inverse)
        index = np.indices(hole.shape, dtype=np.float64)
        points = self.rays.points(index[0], index[1], np.where(count > 0, mean, np.nan))
        return np.where(hole[..., None], points, self.scan.points)
