"""Corrections applied to the sheets of a scan, before these are flattened."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from restore.camera.rays import Rays
from restore.edits.model import WHOLE, Frame, PageEdits, PartEdits, Point
from restore.edits.polygons import checked_polygon, within_image
from restore.errors import BadInput, NotEnoughSurface
from restore.findings import Finding
from restore.layout.crease import Crease
from restore.layout.find import Inspected
from restore.layout.leaves import Leaves, leaves_of
from restore.layout.split import range_image_of
from restore.numerics.polygons import inside_polygon
from restore.prepared.separate import LeafSpine, SeparateSheet
from restore.range_image.segmentation.segment import MIN_FRACTION
from restore.scan import Floats, Mask, RangeScan

SPINE_POINTS = 33  # on the polyline that was drawn
SPINE_HINT = "give points from head to tail of the page, each below the one before"
ERASED_HINT = "make the masks smaller, or the outline larger"


def edited_leaves(inspected: Inspected, edits: PageEdits) -> Leaves:
    """Return the sheets of a scan that become pages, corrected.

    Raises BadInput for corrections that do not fit the scan, NotEnoughSurface where they leave too little of a page.
    """
    layout = "whole" if edits.layout == "auto" and edits.kind in WHOLE else edits.layout
    if edits.spine is not None:
        inspected = replace(inspected, crease=_drawn_spine(inspected, edits.spine, edits.frame))
        layout = "split" if layout == "auto" else layout
    leaves = leaves_of(inspected, layout, edits.overlap_mm)
    corrected = {
        name: _corrected(inspected, sheet, edits.part(name), edits.frame) for name, sheet in leaves.parts.items()
    }
    return replace(leaves, parts=corrected, findings=leaves.findings + _unused(edits, list(corrected)))


def _unused(edits: PageEdits, parts: list[str]) -> tuple[Finding, ...]:
    """Report each part that is corrected and that the scan does not give.

    One with the corrections of another part is not reported, nor one that is only of another size.
    """
    changing = {name: part.model_copy(update={"size_mm": None}) for name, part in edits.parts.items()}
    used = [part for name, part in changing.items() if name in parts]
    names = [name for name, part in changing.items() if name not in parts and part not in [PartEdits(), *used]]
    return tuple(Finding.of("part_not_found", part=name, parts=", ".join(parts)) for name in names)


def _drawn_spine(inspected: Inspected, points: tuple[Point, ...], frame: Frame) -> Crease:
    if inspected.flattened is None:
        raise BadInput("a spine cannot be drawn on this scan", "leave out spine")
    sheet = inspected.flattened.sheet
    places, size = _places(sheet.scan, frame, sheet.pixels)
    drawn = within_image(_seen(points, sheet.rays, frame), size, "spine")
    if (np.diff(drawn[:, 1]) <= 0).any() or np.ptp(drawn[:, 0]) > np.ptp(drawn[:, 1]):
        raise BadInput("spine: its points do not run from head to tail", SPINE_HINT)
    rows, cols = np.indices(sheet.inside.shape)
    design = np.column_stack([places.reshape(-1, 2), np.ones(rows.size)])
    to_grid = np.linalg.lstsq(design, np.column_stack([rows.ravel(), cols.ravel()]))[0]
    down = np.linspace(drawn[0, 1], drawn[-1, 1], SPINE_POINTS)
    line = np.column_stack([np.interp(down, drawn[:, 1], drawn[:, 0]), down, np.ones(SPINE_POINTS)])
    nodes = line @ to_grid
    at = np.clip(np.rint(nodes).astype(int), 0, np.array(sheet.inside.shape) - 1)
    if not sheet.inside[at[:, 0], at[:, 1]][1:-1].any():
        raise BadInput("spine: it does not lie on the page", SPINE_HINT)
    return Crease(nodes, 0.0)


def _corrected(inspected: Inspected, sheet: SeparateSheet, part: PartEdits, frame: Frame) -> SeparateSheet:
    """A sheet with its outline, masks and rotation as they were drawn."""
    if part.outline is None and not part.masks:
        return replace(sheet, rotate_deg=part.rotate_deg)
    of_mesh = sheet.of_mesh or sheet.segmented is None
    segmented = sheet.segmented or range_image_of(inspected)
    rays, (places, size) = segmented.rays, _places(segmented.scan, frame, segmented.scan.texture_xy)
    samples, inside = segmented.samples, segmented.inside
    if part.outline is not None:
        paper = inside_polygon(places, checked_polygon(_seen(part.outline, rays, frame), size, "outline"))
        if not (paper & segmented.scan.measured).any():
            raise BadInput("outline: nothing was measured inside it", "draw it round the page")
        if sheet.spine is not None:  # the spine stays where it is
            paper &= _on_side(sheet.spine, sheet.part, paper.shape[1])
        samples, inside = paper & segmented.scan.measured, paper
    erased = np.zeros(inside.shape, bool)
    for number, mask in enumerate(part.masks):
        area = inside_polygon(places, checked_polygon(_seen(mask.polygon, rays, frame), size, f"masks.{number}"))
        if mask.what == "keep":
            if sheet.spine is not None:
                area &= _on_side(sheet.spine, sheet.part, area.shape[1])
            samples, inside = samples | (area & segmented.scan.measured), inside | area
        else:
            erased |= area
    samples = samples & ~erased
    if min(float(samples.mean()), float(inside.mean())) < MIN_FRACTION:
        raise NotEnoughSurface(f"the corrections leave {samples.mean():.1%} of the image", ERASED_HINT)
    corrected = replace(segmented, samples=samples, inside=inside)
    return replace(
        sheet, segmented=corrected, prepared=None, of_mesh=of_mesh, erased=erased, rotate_deg=part.rotate_deg
    )


def _on_side(spine: LeafSpine, side: str, width: int) -> Mask:
    """Return which samples (rows, cols) are on a leaf's side of its spine."""
    past = np.arange(width) - spine.cols[:, None]
    return np.asarray(past <= 0 if side == "left" else past >= 0)


def _places(scan: RangeScan, frame: Frame, pixels: Floats) -> tuple[Floats, tuple[int, int]]:
    """Return where each sample is in the image that points are drawn on.

    (rows, cols, 2), and its height and width.
    pixels: (rows, cols, 2), the places in the colour image. Points in space are on the grid of samples.
    """
    if frame == "space":
        rows, cols = np.indices(scan.points.shape[:2]).astype(np.float64)
        return np.dstack([cols, rows]), scan.points.shape[:2]
    if scan.texture is None:
        raise BadInput("corrections are drawn on the colour image, and the scan has none", "give points in space")
    return pixels, scan.texture.shape[:2]


def _seen(points: Sequence[Point], rays: Rays, frame: Frame) -> Floats:
    """Return where points (n, 2) px or (n, 3) mm are in that image, (n, 2)."""
    drawn = np.array(points, float)
    return np.stack(rays.grid(drawn)[::-1], axis=1) if frame == "space" else drawn
