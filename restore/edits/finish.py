"""Corrections of a restored page, made after it was textured: quarter turns and the crop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from restore.edits.model import Crop, PartEdits
from restore.errors import NotEnoughSurface
from restore.findings import Finding
from restore.numerics.robust import MAJORITY
from restore.orientation import rotate_page
from restore.outline.rectangle import page_size
from restore.page import RestoredPage
from restore.report import Report
from restore.scan import Floats, Ints, Mask
from restore.texture.coverage import EDGE_PX, CoverageClass
from restore.texture.page import MM_PER_INCH, PAPER

SIZE_MM = 2.0  # by which a page may differ from the size that was given: leaves of a book differ by less
OTHER_MM = 5.0  # beyond, it is another leaf or not the whole of one: leaves of a book and rulers differ by less
SIDES = ("left", "top", "right", "bottom")
EMPTY = {
    "image": PAPER,
    "master": PAPER,
    "uncropped": PAPER,
    "coverage": CoverageClass.OUTSIDE,
    "mask": False,
    "page_source": 255,
}


def finish_page(page: RestoredPage, part: PartEdits) -> RestoredPage:
    """Return the page turned and cropped by hand, and report the corrections.

    Raises NotEnoughSurface for a crop that leaves nothing of the page.

    >>> corners = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 50.0, 0.0], [0.0, 50.0, 0.0]])
    >>> page = restore(SurfaceMesh(corners, np.array([[0, 1, 2], [0, 2, 3]])), Settings(dpi=30))
    >>> finish_page(page, PartEdits(turn=1)).image.shape
    (118, 59, 3)
    """
    width, height = size_before_rotation(page, part.rotate_deg)
    page = rotate_page(page, 90 * part.turn)
    size = np.array((height, width) if part.turn % 2 else (width, height))
    added = missing_mm(page, size, part)
    found = page.findings + size_findings((size + added[:2] + added[2:]).tolist(), part)
    page = crop_page(with_margins(page, added), part.crop)
    given = part.model_dump(mode="json", exclude_defaults=True)
    report: Report = {**page.report, "edits": given, "findings": [one.as_json() for one in found]}
    return replace(page, report=report, findings=found)


def missing_mm(page: RestoredPage, size_mm: Floats, part: PartEdits) -> Floats:
    """Return by how much sides that are cut off lie within the given size.

    (4,) mm, of SIDES; those that the picture cuts off.
    It is placed from the opposite side, unless that is cut off, too. A page that is rotated by hand is left as it is.
    """
    missing = np.zeros(len(SIDES))
    if part.size_mm is None or part.rotate_deg or page.report["coverage"]["cropped_fraction"] is None:
        return missing
    cut = cut_sides(page)
    alone = cut & ~np.roll(cut, 2)
    missing[alone] = np.maximum(np.tile(np.subtract(part.size_mm, size_mm), 2), 0.0)[alone]
    return missing


def cut_sides(page: RestoredPage) -> Mask:
    """Return which of SIDES lie for the most part at the edge of the picture, (4,) bool."""
    assert page.fine.texture is not None
    on_page, last = page.coverage != CoverageClass.OUTSIDE, np.array(page.fine.texture.shape[1::-1]) - 1
    at_edge = ((page.page_map <= EDGE_PX) | (page.page_map >= last - EDGE_PX)).any(axis=2)
    cut = []
    for quarters in range(len(SIDES)):  # counter-clockwise, which brings each side to the left
        shown, edge = np.rot90(on_page, quarters), np.rot90(at_edge, quarters)
        rows = np.flatnonzero(shown.any(axis=1))
        cut.append(edge[rows, shown[rows].argmax(axis=1)].mean() > MAJORITY)
    return np.array(cut)


def with_margins(page: RestoredPage, added: Floats) -> RestoredPage:
    """Return a page that is wider by (4,) mm at SIDES; the report lists those in `given`."""
    if not added.any():
        return page
    height, width = page.image.shape[:2]
    edges = np.rint(np.array([0, 0, width, height]) + np.array([-1, -1, 1, 1]) * added * page.dpi / MM_PER_INCH).astype(
        np.int64
    )
    size = np.add(page.report["page_mm"], added[:2] + added[2:]).tolist()
    given = [side for side, more in zip(SIDES, added, strict=True) if more]
    return replace(_cropped_to(page, edges), report={**page.report, "page_mm": size, "given": given})


def size_before_rotation(page: RestoredPage, degrees: float) -> tuple[float, float]:
    """Return width and height of a page or leaf, mm, without its rotation by hand."""
    fine = page.fine
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    width, height = page_size(fine.flat[fine.topology.border] @ np.array([[cos, sin], [-sin, cos]]))
    facing = page.report["coverage"]["facing"]  # of the leaf's own width
    return float(width * (1.0 - facing)), float(height)


def size_findings(size_mm: Sequence[float], part: PartEdits) -> tuple[Finding, ...]:
    """Report a page of another size than was given. Nothing is scaled.

    size_mm: width and height of the page as it is read.

    >>> [one.code for one in size_findings((120.0, 173.0), PartEdits(size_mm=(120.0, 170.0)))]
    ['size_differs']
    >>> [one.code for one in size_findings((120.0, 110.0), PartEdits(size_mm=(120.0, 170.0)))]
    ['size_wrong']
    """
    if part.size_mm is None:
        return ()
    off = max(abs(a - b) for a, b in zip(size_mm, part.size_mm, strict=True))
    if off <= SIZE_MM:
        return ()
    names = ("width_mm", "height_mm", "given_width_mm", "given_height_mm")
    sizes = dict(zip(names, (*size_mm, *part.size_mm), strict=True))
    return (Finding.of("size_differs", **sizes) if off <= OTHER_MM else Finding.of("size_wrong", **sizes),)


def crop_page(page: RestoredPage, crop: Crop) -> RestoredPage:
    """Return the page with a margin, or the box that a crop names.

    Nothing is sampled again, and `uncropped` keeps the master.
    """
    if crop.mode == "paper" or (crop.mode == "margin" and crop.margin_mm == 0):
        return page
    height, width = page.image.shape[:2]
    per_mm = page.dpi / MM_PER_INCH
    margin = crop.margin_mm * per_mm
    box = (-margin, -margin, width + margin, height + margin)
    if crop.box is not None and crop.mode == "box":
        left, top, right, bottom = (side * per_mm for side in crop.box)
        box = (max(left, -width), max(top, -height), min(right, 2.0 * width), min(bottom, 2.0 * height))
    edges = np.rint(box).astype(np.int64)
    if (edges[2:] <= np.maximum(edges[:2], 0)).any() or edges[0] >= width or edges[1] >= height:
        raise NotEnoughSurface("the crop leaves nothing of the page", "draw a box that lies on the page")
    cropped, whole = _cropped_to(page, edges), page.pictures.get("uncropped", page.pictures["master"])
    size = [float(edges[2] - edges[0]) / per_mm, float(edges[3] - edges[1]) / per_mm]
    pictures = {**cropped.pictures, "uncropped": whole}
    return replace(cropped, report={**page.report, "page_mm": size}, pictures=pictures)


def _cropped_to(page: RestoredPage, edges: Ints) -> RestoredPage:
    """Crop the pictures of a page to edges (left, top, right, bottom)."""
    height, width = page.image.shape[:2]
    left, top, right, bottom = edges.tolist()
    trimmed = np.add(page.trimmed, (left, top, width - right, height - bottom)).tolist()
    cropped = page.changed_pictures(lambda name, values: _cropped(values, edges, EMPTY.get(name, np.nan)))
    return replace(cropped, trimmed=tuple(trimmed))


def _cropped(values: NDArray[Any], edges: Ints, empty: Any) -> NDArray[Any]:
    """Crop an array (h, w, …) to edges (left, top, right, bottom).

    The edges may lie outside it.
    """
    left, top, right, bottom = edges.tolist()
    height, width = values.shape[:2]
    cut = np.full((bottom - top, right - left, *values.shape[2:]), empty, values.dtype)
    rows, cols = slice(max(top, 0), min(bottom, height)), slice(max(left, 0), min(right, width))
    cut[rows.start - top : rows.stop - top, cols.start - left : cols.stop - left] = values[rows, cols]
    return cut
