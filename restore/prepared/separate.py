"""Several sheets in one scan: which there are, and each as a scan of its own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from restore.camera.rays import MAX_GAP, find_rays
from restore.errors import RestoreError
from restore.mesh.adjacency import components
from restore.mesh.clean import clean, large_pieces, select, weld
from restore.mesh.measures import straight_lengths, surface_area
from restore.mesh.ordered_grid import GridMesh
from restore.mesh.pose import pose_on_table
from restore.mesh.topology import Topology
from restore.mesh.triangulate import triangulate
from restore.mesh.validate import ValidMesh, validated
from restore.outline.rectangle import fills_rectangle
from restore.prepared.flatten import flatten
from restore.prepared.prepared import Prepared
from restore.range_image.hidden_gutter import find_hidden_gutter
from restore.range_image.remove_table import remove_table
from restore.range_image.segmentation.segment import SegmentedScan, find_pieces
from restore.runtime.arguments import checks_types
from restore.scan import Floats, InterpolatedMesh, Ints, Mask, Part, RangeScan, ScannedSheet, SurfaceMesh
from restore.scan_check import refuse_unusable_image, refuse_unusable_mesh

OUTLINE_POINTS = 300  # of a sheet that is flattened for its outline alone: ten on each side of a page


class LeafSpine(NamedTuple):
    """Where a leaf ends.

    cols        (rows,) column of the spine in each row of the range image.
    facing      (rows,) column on the facing page at the end of the strip that the leaf keeps.
    overlap_mm  width of that strip.
    """

    cols: Floats
    facing: Floats
    overlap_mm: float


@dataclass(frozen=True, eq=False)
class SeparateSheet(ScannedSheet):
    """A sheet with what is known of it already.

    segmented   the sheet in its range image, which need not be looked for again; None for a mesh or an empty scan.
    prepared    the sheet as it was prepared already; None where it was not.
    spine       of one leaf of an opened book.
    of_mesh     whether that image is the view of a mesh.
    erased      (rows, cols) of the range image, True where paper is removed by hand.
    rotate_deg  clockwise, by which the flat page is turned by hand.
    """

    segmented: SegmentedScan | None = None
    prepared: Prepared | None = None
    spine: LeafSpine | None = None
    of_mesh: bool = False
    erased: Mask | None = None
    rotate_deg: float = 0.0

    @cached_property
    def is_rectangular(self) -> bool:
        """Return whether the flat sheet is a rectangle.

        It is a whole page, then, not a fragment of a torn one.
        """
        if isinstance(self.scan, SurfaceMesh):
            return _is_rectangular(self.scan)
        alone = self.scan if self.segmented is None else _without(self.scan, [~self.segmented.samples])
        return bool(alone.measured.any()) and _is_rectangular(triangulate(alone))

    @property
    def area(self) -> Mask | None:
        """Return the sheet in a range image (rows, cols), None where not known."""
        return None if self.segmented is None or self.of_mesh else self.segmented.inside


@checks_types
def separate_sheets(scan: RangeScan | SurfaceMesh) -> list[ScannedSheet]:
    """Return the sheets of a scan, left to right; one, the scan itself, where it holds one.

    A segment of a CT volume is one sheet: what its order joins is one, also over gaps. Connected pieces nearer to each
    other than MAX_GAP samples or edges are of one sheet: drop-outs part it so. So are those between which a range image
    has only lost samples, as many as `find_pieces` goes on over. Two that are the leaves of a book with a gutter that
    gave no range are named `left` and `right` by their `part`. Raises NotEnoughSurface when the scan has no surface,
    BadInput for a damaged mesh.

    >>> rows, cols = np.indices((11, 11)).astype(float)
    >>> points = np.dstack([10.0 * cols, 10.0 * rows, np.zeros((11, 11))]).reshape(-1, 3)
    >>> first = np.arange(110).reshape(10, 11)[:, :-1].ravel()
    >>> square = np.concatenate([first[:, None] + [0, 1, 12], first[:, None] + [0, 12, 11]])
    >>> two = SurfaceMesh(np.concatenate([points, points + [300.0, 0.0, 0.0]]), np.concatenate([square, square + 121]))
    >>> [round(sheet.size) for sheet in separate_sheets(two)]
    [10000, 10000]
    """
    return [*find_sheets(scan)]


def find_sheets(scan: RangeScan | SurfaceMesh | ScannedSheet) -> list[SeparateSheet]:
    """Return the sheets of a scan, or the sheet that was given, alone."""
    if isinstance(scan, SeparateSheet):
        return [scan]
    if isinstance(scan, SurfaceMesh):
        refuse_unusable_mesh(scan)
        if isinstance(scan, GridMesh):
            return [SeparateSheet(scan, surface_area(scan.vertices, scan.faces))]
        return _sheets_of_mesh(scan)
    assert isinstance(scan, RangeScan)
    return _sheets_of_range_image(scan)


def source_of(scan: RangeScan | SurfaceMesh | ScannedSheet) -> RangeScan | SurfaceMesh:
    """Return the scan in which a sheet was found, or the scan itself."""
    return scan.scan if isinstance(scan, ScannedSheet) else scan


def rotation_of(scan: RangeScan | SurfaceMesh | ScannedSheet) -> float:
    """Return the degrees, clockwise, by which the flat page of a sheet is turned by hand."""
    return scan.rotate_deg if isinstance(scan, SeparateSheet) else 0.0


def _sheets_of_range_image(scan: RangeScan) -> list[SeparateSheet]:
    refuse_unusable_image(scan)
    rays = find_rays(scan)
    if rays is None:
        sheets = _sheets_of_mesh(triangulate(scan)) if scan.measured.any() else []
        return sheets if len(sheets) > 1 else [SeparateSheet(scan, float(scan.measured.sum()))]
    found = find_pieces(scan, rays)
    if not found:
        return [SeparateSheet(scan, 0.0)]
    found.sort(key=lambda piece: float(np.nonzero(piece.samples)[1].mean()))
    alone = [_without(piece.scan, [other.samples for other in found if other is not piece]) for piece in found]
    sheets = [
        SeparateSheet(one, float(piece.samples.sum()), replace(piece, scan=one))
        for one, piece in zip(alone, found, strict=True)
    ]
    gutter = find_hidden_gutter(found)
    if gutter is not None:
        sides: dict[Part, int] = {"left": gutter.left, "right": gutter.right}
        for part, at in sides.items():
            sheets[at] = replace(sheets[at], part=part, gutter_hidden_mm=gutter.hidden_mm)
    return sheets


def _without(scan: RangeScan, others: list[Mask]) -> RangeScan:
    """The scan without the samples (rows, cols) of others."""
    if not others:
        return scan
    return replace(scan, points=np.where(np.logical_or.reduce(others)[..., None], np.nan, scan.points))


def _is_rectangular(mesh: SurfaceMesh) -> bool:
    try:
        page = flatten(clean(mesh, OUTLINE_POINTS))
    except RestoreError:  # closed, one-sided: no sheet of any shape
        return False
    return fills_rectangle(page.flat[page.topology.border], float(page.areas.sum()))


def _sheets_of_mesh(scan: SurfaceMesh) -> list[SeparateSheet]:
    mesh = validated(weld(validated(scan)))
    pieces = [mesh.faces[member] for member in large_pieces(mesh)]
    if len(pieces) == 1 and not isinstance(scan, InterpolatedMesh):  # may be a table with sheets on it
        mesh = remove_table(mesh)
        pieces = [mesh.faces[member] for member in large_pieces(mesh)]
    sheets = _joined_over_gaps(mesh, pieces) if len(pieces) > 1 else pieces
    if len(sheets) < 2:
        return [SeparateSheet(scan, surface_area(mesh.vertices, mesh.faces))]
    seen = pose_on_table(mesh.vertices, mesh.faces).seen
    sheets.sort(key=lambda faces: float(seen[np.unique(faces), 0].mean()))
    return [SeparateSheet(select(mesh, faces), surface_area(mesh.vertices, faces)) for faces in sheets]


def _joined_over_gaps(mesh: ValidMesh, pieces: list[Ints]) -> list[Ints]:
    """The faces (m, 3) of each sheet, from those of its pieces."""
    reach = (MAX_GAP + 1) * float(straight_lengths(mesh.vertices, mesh.topology.edges).mean())
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
    """Return the border vertices of faces (m, 3), or all without a border."""
    border = Topology(faces).border
    return cKDTree(vertices[border if len(border) else np.unique(faces)])
