"""Split the samples of an opened book at its spine: each leaf is a sheet by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from restore.errors import BadInput
from restore.layout.crease import Crease
from restore.layout.decide import OVERLAP_MM
from restore.layout.find import Inspected
from restore.layout.flattened import FlattenedSheet
from restore.mesh.raster import rasterise
from restore.numerics.robust import SIGNIFICANT
from restore.prepared.separate import LeafSpine, SeparateSheet
from restore.range_image.facets.sheet import Sheet
from restore.range_image.segmentation.segment import SegmentedScan
from restore.scan import Floats, Mask, Part


def split_at_crease(inspected: Inspected, overlap_mm: float = OVERLAP_MM) -> dict[str, SeparateSheet]:
    """Return the leaves left and right of the spine of a sheet.

    Each has a strip of the other next to the spine. Raises BadInput where no valley was found, or for a mesh that no
    single view shows.
    """
    crease, flattened = inspected.crease, inspected.flattened
    if flattened is None or crease is None:
        raise BadInput("the scan has no valley at which it could be split", "restore it whole: --layout whole")
    whole = inspected.largest
    of_mesh = whole is None or whole.segmented is None
    segmented = range_image_of(inspected)
    cols = _cols_on(segmented, flattened.sheet, crease)
    beyond = _distance(segmented, flattened, cols)
    overlap = max(overlap_mm, SIGNIFICANT * (inspected.finding.sigma_mm or 0.0))
    past = np.arange(segmented.inside.shape[1]) - cols[:, None]
    sides: dict[Part, tuple[Mask, float]] = {"left": (past <= 0, overlap), "right": (past >= 0, -overlap)}
    parts: dict[str, SeparateSheet] = {}
    for side, (kept, distance) in sides.items():
        leaf = replace(segmented, samples=segmented.samples & kept, inside=segmented.inside & kept)
        spine = LeafSpine(cols, _cols_at(beyond, distance, cols), overlap)
        size = float(leaf.samples.sum())
        parts[side] = SeparateSheet(segmented.scan, size, leaf, spine=spine, of_mesh=of_mesh, part=side)
    return parts


def range_image_of(inspected: Inspected) -> SegmentedScan:
    """Return the range image of the largest sheet: the scanner's own, or a mesh's view.

    Raises BadInput for a mesh that no single view shows.
    """
    whole = inspected.largest
    if whole is not None and whole.segmented is not None:
        return whole.segmented
    if inspected.flattened is None:
        raise BadInput("no single view shows this mesh", "restore it whole: --layout whole")
    sheet = inspected.flattened.sheet
    scan = replace(sheet.scan, texture_xy=sheet.pixels)
    return SegmentedScan(scan, sheet.rays, sheet.measured, sheet.inside)


def _cols_on(segmented: SegmentedScan, sheet: Sheet, crease: Crease) -> Floats:
    """Return the column (rows,) of a sheet's crease in each row of its range image."""
    down, right = _offset(segmented, sheet)
    rows = np.arange(segmented.inside.shape[0])
    row, col = crease.nodes.T + [[down], [right]]
    ends = [(col[1] - col[0]) / (row[1] - row[0]), (col[-1] - col[-2]) / (row[-1] - row[-2])]
    before, after = col[0] + ends[0] * (rows - row[0]), col[-1] + ends[1] * (rows - row[-1])
    return np.where(rows < row[0], before, np.where(rows > row[-1], after, np.interp(rows, row, col)))


def _distance(segmented: SegmentedScan, flattened: FlattenedSheet, cols: Floats) -> Floats:
    """Return distances (rows, cols) mm on the paper from a spine.

    At columns (rows,); negative left of it; ±inf off the flat page.
    """
    page = flattened.unrolled
    down, right = _offset(segmented, flattened.sheet)
    height, width = segmented.inside.shape
    nodes = np.ascontiguousarray(page.nodes[:, ::-1] + [right, down])
    across = rasterise(nodes, page.fine.faces, page.fine.flat, height, width)[..., 0].astype(float)
    rows = np.arange(height)
    first = np.clip(np.floor(cols).astype(int), 0, width - 2)
    low, high = across[rows, first], across[rows, first + 1]
    spine = low + (high - low) * (cols - first)
    known = np.isfinite(spine)
    spine = np.interp(rows, rows[known], spine[known])
    off_page = np.where(np.arange(width) < cols[:, None], -np.inf, np.inf)
    return np.where(np.isfinite(across), across - spine[:, None], off_page)


def _cols_at(beyond: Floats, distance: float, cols: Floats) -> Floats:
    """Return the columns (rows,) at a distance of mm from the spine.

    distance: (rows, cols); as in other rows where unknown.
    """
    found = np.full(len(cols), np.nan)
    for row, values in enumerate(beyond):
        known = np.flatnonzero(np.isfinite(values))
        if len(known) > 1 and values[known[0]] <= distance <= values[known[-1]]:
            found[row] = np.interp(distance, values[known], known)
    past = found - cols
    return cols + np.where(np.isfinite(past), past, np.nanmedian(past))


def _offset(segmented: SegmentedScan, sheet: Sheet) -> tuple[float, float]:
    """Rows and columns by which the grid of a sheet starts after that of the range image."""
    rays = segmented.rays
    return (sheet.rays.y0 - rays.y0) / rays.dy, (sheet.rays.x0 - rays.x0) / rays.dx
