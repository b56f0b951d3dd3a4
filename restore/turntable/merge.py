"""Merge the views of a turntable: what one view misses, another has seen.

The range grid of one view stays as it is, samples, rays and picture. Where it has a hole (the laser's shadow, ink that
swallowed the light) the surfaces of the others are looked at along the very same rays. So whatever relies on the rays
of one shot goes on working, and the picture needs no seams: the camera saw what only the laser missed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from restore.errors import BadInput
from restore.raster import rasterise
from restore.rays import Rays, find_rays
from restore.scan import Floats, Ints, Mask, RangeScan
from restore.strain import signed_areas
from restore.triangulate import triangulate
from restore.turntable.axis import RotationAxis
from restore.turntable.register import register

MAX_SLOPE = 6.0  # 80.5°: a steeper face spans the step from one surface to another
SAME_SURFACE = 6.0  # samples along the ray: farther apart, two views see different surfaces
MAX_RESIDUAL = 1 / 3  # of a sample's spacing: noise stays well below it, a page that moved does not
LEAST_OVERLAP = 0.2  # of the samples of the smaller view
ONE_SIGMA = 68.27  # percentile of absolute values
DRAWN = 12.0  # samples round a hole over which a view is drawn to the reference


@dataclass(frozen=True)
class View:
    """What became of one view.

    turn_deg     what the stage had turned.
    residual_mm  distance from the reference's surface below which 68 % of the shared samples lie; None without any.
    moved_mm     how far registration moved the middle of the view from where the stage put it.
    filled       samples of the reference that it filled.
    refused      why it was left out; empty when it was not.
    """

    turn_deg: float
    residual_mm: float | None
    moved_mm: float
    filled: int
    refused: str = ""


@dataclass(frozen=True, eq=False)
class MergedViews:
    """One scan made of several.

    scan       the reference view, its holes filled as far as others saw them.
    reference  its place among the views.
    views      what became of each, the reference among them.
    """

    scan: RangeScan
    reference: int
    views: tuple[View, ...]

    @property
    def warnings(self) -> list[str]:
        """One line for each view that was left out."""
        return [f"the view at {view.turn_deg:g}° was left out: {view.refused}" for view in self.views if view.refused]


def merge_views(scans: Sequence[RangeScan], turns_deg: Sequence[float], axis: RotationAxis) -> MergedViews:
    """Merge shots of one page that a turntable turned between them.

    turns_deg  what the stage had turned before each shot; the view nearest to 0° is the reference.
    A view that does not fit is left out, with a warning.
    Raises BadInput when there is no view, or a view is not one shot of a scanner, NotEnoughSurface for an empty one.
    """
    if not scans or len(scans) != len(turns_deg):
        raise BadInput(f"{len(scans)} views and {len(turns_deg)} angles", "give one angle for each view")
    rays = [_rays(scan) for scan in scans]
    turns = [(turn + 180.0) % 360.0 - 180.0 for turn in turns_deg]
    chosen = int(np.argmin(np.abs(turns)))
    frame = _Frame(scans[chosen], rays[chosen])
    views, layers = [], []
    for index, (scan, turn) in enumerate(zip(scans, turns, strict=True)):
        if index == chosen:
            views.append(View(turn, 0.0, 0.0, 0))
            continue
        view, layer = _fit(scan, rays[index], frame, axis.turn(turns[chosen] - turn), turn)
        views.append(view)
        layers.append(layer)
    points = frame.filled(layers)
    told = [{key: value for key, value in vars(view).items() if value != ""} for view in views]
    provenance = {**scans[chosen].provenance, "views": told}
    return MergedViews(replace(scans[chosen], points=points, provenance=provenance), chosen, tuple(views))


class _Frame:
    """The reference view as what others are held against.

    inverse  (rows, cols) 1/D, NaN where nothing was measured.
    facing   (rows, cols) cosine between the ray and the surface's normal, NaN where a neighbour is missing.
    spacing  mm between samples.
    """

    def __init__(self, scan: RangeScan, rays: Rays) -> None:
        self.scan, self.rays = scan, rays
        self.inverse = np.where(scan.measured, -1.0 / scan.points[..., 2], np.nan)
        self.spacing = float(rays.dx / np.nanmedian(self.inverse))
        right, down = (np.gradient(scan.points, axis=axis) for axis in (1, 0))
        normal = np.cross(down, right)
        sight = scan.points / np.linalg.norm(scan.points, axis=2, keepdims=True)
        self.facing = np.abs((normal * sight).sum(axis=2)) / np.linalg.norm(normal, axis=2)

    def filled(self, layers: Sequence[Floats]) -> Floats:
        """(rows, cols, 3) mm: the reference's points, and where it has none, the surface that the rays meet first."""
        inverse = self.inverse
        hole = np.isnan(inverse)
        if layers:
            stack = np.stack(layers)
            seen = np.isfinite(stack)
            first = np.where(seen, stack, -np.inf).max(axis=0)
            with np.errstate(invalid="ignore"):
                same = seen & (1.0 / stack - 1.0 / first < SAME_SURFACE * self.spacing)
            count = same.sum(axis=0)
            mean = np.where(same, stack, 0.0).sum(axis=0) / np.maximum(count, 1)
            inverse = np.where(hole & (count > 0), mean, inverse)
        index = np.indices(inverse.shape, dtype=np.float64)
        return np.where(hole[..., None], self.rays.points(index[0], index[1], inverse), self.scan.points)


def _rays(scan: RangeScan) -> Rays:
    rays = find_rays(scan)
    if rays is None:
        raise BadInput("a view is not one shot of a scanner", "merge the scan folders that the scanner's shots left")
    return rays


def _fit(scan: RangeScan, rays: Rays, frame: _Frame, start: Floats, turn: float) -> tuple[View, Floats]:
    """Register a view and look at it along the reference's rays: what came of it, and (rows, cols) 1/D to fill with."""
    motion = register(scan, frame.scan, start, frame.spacing)
    middle = scan.points[scan.measured].mean(axis=0)
    moved = float(np.linalg.norm((motion - start)[:3, :3] @ middle + (motion - start)[:3, 3]))
    layer = _seen_from(scan, rays, frame, motion)
    apart = (1.0 / layer - 1.0 / frame.inverse) * frame.facing
    shared = np.isfinite(apart)
    least = min(int(scan.measured.sum()), int(np.isfinite(frame.inverse).sum()))
    residual = float(np.percentile(np.abs(apart[shared]), ONE_SIGMA)) if shared.any() else None
    refused = ""
    if residual is None or shared.sum() < LEAST_OVERLAP * least:
        refused = f"it shares {shared.sum() / least:.0%} of its samples with the view at the reference"
    elif residual > MAX_RESIDUAL * frame.spacing:
        refused = f"its surface lies {residual:.2f} mm off, so the page moved or the axis is wrong"
    if refused:
        return View(turn, residual, moved, 0, refused), np.full_like(layer, np.nan)
    layer = _drawn(layer, frame)
    filled = int((np.isnan(frame.inverse) & np.isfinite(layer)).sum())
    return View(turn, residual, moved, filled), layer


def _seen_from(scan: RangeScan, rays: Rays, frame: _Frame, motion: Floats) -> Floats:
    """(rows, cols) 1/D of a view's surface along the reference's rays, NaN where they miss it."""
    mesh = triangulate(scan)
    faces = mesh.faces[_one_surface(mesh.vertices, mesh.faces, rays)]
    points = mesh.vertices @ motion[:3, :3].T + motion[:3, 3]
    rows, cols = frame.rays.grid(points)
    corners = np.column_stack([cols, rows])
    faces = faces[signed_areas(corners * [1.0, -1.0], faces) > 0]  # the others are turned away
    inverse = -1.0 / points[:, 2]
    nearest_last = faces[np.argsort(inverse[faces].mean(axis=1))]
    shape = frame.inverse.shape
    return np.asarray(rasterise(corners, nearest_last, inverse[:, None], *shape)[..., 0], np.float64)


def _one_surface(points: Floats, faces: Ints, rays: Rays) -> Mask:
    """(m,) bool: faces that lie on one surface, seen from the view's own place."""
    depth = -points[faces][..., 2]
    return np.asarray(np.ptp(depth, axis=1) < MAX_SLOPE * rays.dx * depth.min(axis=1))


def _drawn(layer: Floats, frame: _Frame) -> Floats:
    """The layer without what it is off, on average, where the reference sees the same surface nearby.

    So a hole is filled without a step at its rim.
    """
    off = layer - frame.inverse
    with np.errstate(invalid="ignore"):
        shared = np.abs(1.0 / layer - 1.0 / frame.inverse) < SAME_SURFACE * frame.spacing
    near = cv2.GaussianBlur(shared.astype(np.float64), (0, 0), DRAWN)
    mean = cv2.GaussianBlur(np.where(shared, off, 0.0), (0, 0), DRAWN)
    return np.asarray(layer - mean / np.maximum(near, np.finfo(float).tiny))
