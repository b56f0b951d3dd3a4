"""Finds the layout of a scan: looks for a spine on the flattened whole and checks it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from restore.layout.crease import Crease, place_crease
from restore.layout.crossing import print_over_spine
from restore.layout.decide import decide
from restore.layout.finding import BookPrior, LayoutFinding
from restore.layout.flattened import FlattenedSheet
from restore.layout.spine import PER_MM, Spine, find_spine, tilt_map
from restore.page import FlatMesh
from restore.prepared.prepare import prepare
from restore.prepared.prepared import Prepared, Unrolled, unrolled
from restore.prepared.refine import interpolate_flat_positions
from restore.prepared.separate import SeparateSheet, find_sheets
from restore.range_image.facets.creases import HALF_WIDTH
from restore.range_image.facets.sheet import Sheet
from restore.range_image.hidden_gutter import find_hidden_gutter
from restore.runtime.arguments import checks_types
from restore.runtime.results import Kept
from restore.scan import Floats, RangeScan, ScannedSheet, SurfaceMesh
from restore.settings import Settings
from restore.texture.page import MM_PER_INCH, page_map


@dataclass(frozen=True, eq=False)
class Inspected:
    """A scan whose layout was found.

    sheets   its sheets, left to right; the two leaves alone where the gutter gave no range.
    largest  of them, flattened; None where that was not needed.
    crease   the spine on the grid of the flattened sheet.
    """

    finding: LayoutFinding
    sheets: list[SeparateSheet]
    largest: SeparateSheet | None = None
    flattened: FlattenedSheet | None = None
    crease: Crease | None = None


@checks_types
def find_layout(scan: RangeScan | SurfaceMesh | ScannedSheet, prior: BookPrior | None = None) -> LayoutFinding:
    """Find where the spine of an opened book is, and whether it is one.

    The scan is not changed.
    prior: size of a leaf of the volume, by which a strip of the facing page is known.
    Raises NotEnoughSurface when the scan shows no page, BadInput when it cannot be used.

    >>> from drivers.simulated import Facing, Opening, shoot
    >>> scan, truth = shoot(Opening(), Facing(left_mm=100.0), mode="fast", page_mm=(200.0, 140.0))
    >>> finding = find_layout(scan)
    >>> finding.advice, finding.is_spine, [round(width, -1) for width in finding.widths_mm]
    ('split', 'sure', [100.0, 100.0])
    """
    return inspect(scan, Settings(), prior).finding


@contextmanager
def untimed(_stage: str) -> Iterator[None]:
    """A clock that measures nothing."""
    yield


def inspect(
    scan: RangeScan | SurfaceMesh | ScannedSheet,
    settings: Settings,
    prior: BookPrior | None = None,
    kept: Kept | None = None,
) -> Inspected:
    """Find the layout of a scan, with the sheets found on the way, flattened."""
    arguments = scan, settings, prior
    return kept.result(_inspect, *arguments, aside=(kept,)) if kept is not None else _inspect(*arguments, None)


def _inspect(
    scan: RangeScan | SurfaceMesh | ScannedSheet, settings: Settings, prior: BookPrior | None, kept: Kept | None
) -> Inspected:
    sheets = find_sheets(scan)
    leaves = [sheet for sheet in sheets if sheet.part]
    if leaves:
        return Inspected(_hidden(leaves), sheets)
    largest = max(sheets, key=lambda sheet: sheet.size)
    prepared = prepare(largest, kept)
    flat = unrolled(prepared, settings, untimed, kept=kept)
    finding, crease = look(prepared, flat, prior)
    if prepared.on_grid is None:
        return Inspected(finding, sheets, largest)
    flattened = FlattenedSheet(prepared.on_grid, prepared.is_one_shot, unrolled=flat, settings=settings)
    return Inspected(finding, sheets, replace(largest, prepared=flattened), flattened, crease)


def look(prepared: Prepared, unrolled: Unrolled, prior: BookPrior | None) -> tuple[LayoutFinding, Crease | None]:
    """Find the spine on a flattened sheet.

    Where the sheet has a grid, with its place on that.
    """
    fine = unrolled.fine
    up = np.linalg.lstsq(np.column_stack([fine.flat, np.ones(len(fine.flat))]), fine.vertices)[0][1]
    spine = find_spine(tilt_map(prepared.normals_on(fine, MM_PER_INCH * PER_MM, np.eye(3)), up))
    if spine is None:
        return decide(None, None, None, prior), None
    crease = None
    if prepared.on_grid is not None:
        spine, crease = _within_a_sample(prepared.on_grid, unrolled, spine)
    width = float(np.ptp(fine.flat[:, 0]))
    at = float(spine.place[:, 0].mean())
    finding = decide(spine, print_over_spine(fine, spine.place), (at, width - at), prior)
    picture = _on_texture(fine, spine.place)
    return finding if picture is None else replace(finding, spine=picture, frame="picture"), crease


def _within_a_sample(sheet: Sheet, unrolled: Unrolled, spine: Spine) -> tuple[Spine, Crease | None]:
    """The spine placed where both walls meet on the grid; as it was where they do not."""
    fine = unrolled.fine
    nodes = _along(fine, unrolled.nodes, spine.place)
    crease = place_crease(sheet, *nodes.T) if len(nodes) else None
    if crease is None:
        return spine, None
    flat = interpolate_flat_positions(sheet.inside.shape, unrolled.nodes, fine.faces, fine.flat, crease.nodes)
    place = np.column_stack([flat[:, 0] - fine.flat[:, 0].min(), fine.flat[:, 1].max() - flat[:, 1]])
    return replace(spine, place=place, sigma_mm=crease.sigma * _mm_across(sheet, unrolled, crease)), crease


def _mm_across(sheet: Sheet, unrolled: Unrolled, crease: Crease) -> float:
    """Paper of one sample across the crease, in the mean of its walls."""
    shape, fine = sheet.inside.shape, unrolled.fine
    left, right = (
        interpolate_flat_positions(shape, unrolled.nodes, fine.faces, fine.flat, crease.nodes + [0.0, step])
        for step in (-HALF_WIDTH, HALF_WIDTH)
    )
    return float(np.median(np.linalg.norm(right - left, axis=1))) / (2 * HALF_WIDTH)


def _along(fine: FlatMesh, values: Floats, place: Floats) -> Floats:
    """Return values (n, k) at the rows of a place, where the page has any.

    values: (m, k), of the vertices of a flat page.
    place: (p, 2) mm on it.
    """
    on_page = page_map(fine.flat, fine.faces, values, MM_PER_INCH * PER_MM)
    rows = np.arange(on_page.shape[0])
    cols = np.interp((rows + 0.5) / PER_MM, place[:, 1], place[:, 0]) * PER_MM - 0.5
    found = on_page[rows, np.clip(np.rint(cols).astype(int), 0, on_page.shape[1] - 1)].astype(float)
    return found[np.isfinite(found[:, 0])]


def _on_texture(fine: FlatMesh, place: Floats) -> Floats | None:
    """Return texture pixels (3, 2) of head, centre and tail of a place.

    place: (n, 2) mm on the flat page. None without a picture.
    """
    if fine.texture is None or fine.texcoords is None:
        return None
    found = _along(fine, fine.texcoords, place)
    if len(found) < 3:
        return None
    # Every row has its own pixel: the polyline of a straight spine needs three points, and no rounding to a row.
    at = np.arange(len(found))
    fit = np.polyfit(at, found, 2)
    return np.stack([np.polyval(fit[:, k], at[[0, len(at) // 2, -1]]) for k in (0, 1)], axis=1)


def _hidden(leaves: list[SeparateSheet]) -> LayoutFinding:
    """The layout of the leaves left and right of a gutter that gave no range."""
    segmented = [leaf.segmented for leaf in leaves if leaf.segmented is not None]
    gutter = find_hidden_gutter(segmented)
    hidden = leaves[0].gutter_hidden_mm
    return LayoutFinding(
        "split",
        "sure",
        None if gutter is None else gutter.spine,
        sigma_mm=hidden / 2,
        bands=1.0,
        gutter_hidden_mm=hidden,
        reasons=(f"the scan holds two leaves, and the gutter between them gave no range over {hidden:.0f} mm",),
    )
