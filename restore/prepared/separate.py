"""Several sheets in one scan: which there are, and each as a scan of its own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from restore.camera.rays import MAX_GAP, find_rays
from restore.errors import RestoreError
from restore.mesh.adjacency import border_of, components
from restore.mesh.clean import clean, large_pieces, select, weld
from restore.mesh.measures import signed_areas, straight_lengths, surface_area
from restore.mesh.pose import pose_on_table
from restore.mesh.triangulate import triangulate
from restore.mesh.validate import ValidMesh, validated
from restore.outline.rectangle import fills_rectangle
from restore.prepared.flatten import flatten
from restore.range_image.remove_table import remove_table
from restore.range_image.segmentation.segment import SegmentedScan, find_pieces
from restore.runtime.arguments import checks_types
from restore.scan import Floats, InterpolatedMesh, Ints, Mask, RangeScan, SurfaceMesh
from restore.scan_check import refuse_unusable

OUTLINE_POINTS = 300  # of a sheet that is flattened for its outline alone: ten on each side of a page


@dataclass(frozen=True, eq=False)
class ScannedSheet:
    """One sheet of a scan.

    scan       the scan without the other sheets.
    size       area of the sheet in the scan: mm² of a mesh, samples of a range image.
    segmented  the sheet found in the range image: `restore` takes it, and need not look for it again.
    """

    scan: RangeScan | SurfaceMesh
    size: float
    segmented: SegmentedScan | None = None


@checks_types
def separate_sheets(scan: RangeScan | SurfaceMesh) -> list[ScannedSheet]:
    """The sheets of a scan, left to right as the scanner saw them; one, the scan itself, where it holds one.

    Connected pieces nearer to each other than MAX_GAP samples or edges are of one sheet: drop-outs part it so. So are
    those between which a range image has only lost samples, as many as `find_pieces` goes on over.
    Raises NotEnoughSurface when there is no surface, BadInput for a broken mesh.
    """
    refuse_unusable(scan)
    if isinstance(scan, SurfaceMesh):
        return _sheets_of_mesh(scan)
    rays = find_rays(scan)
    if rays is None:
        return _sheets_of_mesh(triangulate(scan)) if scan.measured.any() else [ScannedSheet(scan, 0.0)]
    found = find_pieces(scan, rays)
    if not found:
        return [ScannedSheet(scan, 0.0)]
    found.sort(key=lambda piece: float(np.nonzero(piece.samples)[1].mean()))
    alone = [_without(piece.scan, [other.samples for other in found if other is not piece]) for piece in found]
    return [
        ScannedSheet(one, float(piece.samples.sum()), replace(piece, scan=one))
        for one, piece in zip(alone, found, strict=True)
    ]


def _without(scan: RangeScan, others: list[Mask]) -> RangeScan:
    """The scan without the samples (rows, cols) of others."""
    if not others:
        return scan
    return replace(scan, points=np.where(np.logical_or.reduce(others)[..., None], np.nan, scan.points))


@checks_types
def is_rectangular(mesh: SurfaceMesh) -> bool:
    """True when a connected mesh, laid flat, is a rectangle: a sheet of its own, no fragment of a torn one."""
    try:
        page = flatten(clean(mesh, OUTLINE_POINTS))
    except RestoreError:  # closed, one-sided: no sheet of any shape
        return False
    area = float(signed_areas(page.flat, page.faces).sum())
    return fills_rectangle(page.flat[border_of(page.faces)], area)


def _sheets_of_mesh(scan: SurfaceMesh) -> list[ScannedSheet]:
    mesh = validated(weld(validated(scan)))
    pieces = [mesh.faces[member] for member in large_pieces(mesh)]
    if len(pieces) == 1 and not isinstance(scan, InterpolatedMesh):  # may be a table with sheets on it
        mesh = remove_table(mesh)
        pieces = [mesh.faces[member] for member in large_pieces(mesh)]
    sheets = _joined_over_gaps(mesh, pieces) if len(pieces) > 1 else pieces
    if len(sheets) < 2:
        return [ScannedSheet(scan, surface_area(mesh.vertices, mesh.faces))]
    seen = pose_on_table(mesh.vertices, mesh.faces).seen
    sheets.sort(key=lambda faces: float(seen[np.unique(faces), 0].mean()))
    return [ScannedSheet(select(mesh, faces), surface_area(mesh.vertices, faces)) for faces in sheets]


def _joined_over_gaps(mesh: ValidMesh, pieces: list[Ints]) -> list[Ints]:
    """The faces (m, 3) of each sheet, from those of its pieces."""
    reach = (MAX_GAP + 1) * float(straight_lengths(mesh.vertices, mesh.sides.edges).mean())
    borders = [_border(mesh.vertices, faces) for faces in pieces]
    near = [
        (a, b)
        for a, b in _near_boxes(borders, reach)
        if borders[a].query(borders[b].data, distance_upper_bound=reach)[0].min() < reach
    ]
    label = components(np.array(near, np.int64).reshape(-1, 2), len(pieces))
    return [
        np.concatenate([faces for faces, of in zip(pieces, label, strict=True) if of == sheet])
        for sheet in range(label.max() + 1)
    ]


def _near_boxes(borders: list[cKDTree], reach: float) -> Iterator[tuple[int, int]]:
    """Every two pieces whose bounding boxes come within reach of each other, in mm."""
    low, high = (np.array([getattr(border, name) for border in borders]) for name in ("mins", "maxes"))
    for a in range(len(borders)):
        near = (low[a + 1 :] < high[a] + reach).all(axis=1) & (high[a + 1 :] > low[a] - reach).all(axis=1)
        for b in np.flatnonzero(near) + a + 1:
            yield a, int(b)


def _border(vertices: Floats, faces: Ints) -> cKDTree:
    """The border vertices of faces (m, 3), all of them where there is no border."""
    border = border_of(faces)
    return cKDTree(vertices[border if len(border) else np.unique(faces)])
