"""Finds the table below a sheet: a plane, or nearly one, at the border.

A page that fills the image has planes, too: a panel of a leaflet, lit differently, or the margins of an open book. A
page continues from one of its parts to the next, while what lies on a table ends there, by a step. Where a sheet is too
flat for a step its colour decides.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_erosion, binary_fill_holes

from restore.numerics.robust import MAJORITY
from restore.range_image.segmentation.by_colour import ColouredTable, lab_colours, table_by_colour
from restore.range_image.segmentation.by_depth import table_by_depth
from restore.range_image.segmentation.outline import MIN_SAMPLES, is_enclosed, lies_above, outline_of, page_on
from restore.range_image.segmentation.plane import TablePlane, fit_table_plane, lies_on
from restore.range_image.segmentation.surface import BORDER_BAND
from restore.scan import Floats, Mask, RangeScan

MIN_FRACTION = 0.25  # of the band's samples on one plane, for a table
MAX_PLANES = 2  # tried: a page that leaves the picture may have one in the band itself; parts of a bent one have more
MESH_APART = 4  # samples of the view of a mesh, more than a vertex lies from the next: within a face noise is linear


class Table(NamedTuple):
    """Table in a range image.

    samples: (rows, cols), True on it. False everywhere when no table is detected.
    touching: fraction of the page's outline that touches a table of its own colour, where its edge is not seen.
    alike: (rows, cols), True off its plane where something has its colour; None for a table without one of its own.
    """

    samples: Mask
    touching: float = 0.0
    alike: Mask | None = None


def find_table(scan: RangeScan, inverse_depth: Floats, measured: Mask, *, framed: bool = True) -> Table:
    """Find the table: in its plane and of its colour, or below a page.

    Depth decides where the paper has the table's colour and the page stands clear. A table extends to the frame of the
    image; when that is not the scanner's (`framed` False), as for a mesh that was rotated, it extends to the outer
    border of the measured samples.
    inverse_depth: (rows, cols) 1/mm.
    """
    outer = np.ones_like(measured) if framed else binary_fill_holes(measured)
    band = measured & ~binary_erosion(outer, iterations=BORDER_BAND)
    colour = lab_colours(scan)
    others = band.copy()
    for _ in range(MAX_PLANES):
        if others.sum() < MIN_SAMPLES:
            break
        plane, own = fit_table_plane(scan, inverse_depth, others, 1 if framed else MESH_APART)
        if not (own & plane.samples).any() or (band & plane.samples).sum() < MIN_FRACTION * others.sum():
            break
        found = _in_picture(plane, colour, band, own) if framed else _in_view(plane, colour, band, own)
        if found is not None:
            return found
        others &= ~own  # not all within noise of it: of a page, that may be most of the table just below
    return Table(np.zeros_like(measured))


def _in_picture(plane: TablePlane, colour: Floats | None, band: Mask, own: Mask) -> Table | None:
    """Return the table in a scanner's image, None where the rest is not a sheet on it.

    A sheet stands clear of it with most of its outline, or its colour differs.
    """
    coloured = None if colour is None else table_by_colour(colour, plane, band, own)
    if coloured is not None and _is_sheet_on_table(coloured):
        return Table(coloured.samples, alike=coloured.alike)
    samples = table_by_depth(plane)
    if samples is None:
        return None
    page = page_on(samples, plane)
    outline = outline_of(page, samples, plane)
    surrounded = colour is None and is_enclosed(page, plane.measured) and _surrounds(plane.samples, band)
    return Table(samples, outline.touching) if surrounded or outline.clear > MAJORITY else None


def _is_sheet_on_table(coloured: ColouredTable) -> bool:
    """Whether what has not the colour of a table is a sheet on it.

    It lies flat or ends in the picture on all sides; but what is darker may be a figure, and the "table" the page: then
    it has the thickness of paper at least, or stands clear.
    """
    table, plane, brighter, _ = coloured
    page = page_on(table, plane)
    flat = lies_on(plane, plane.measured & ~table)
    if brighter and (flat or is_enclosed(page, plane.measured)):
        return True
    return (flat and lies_above(page, table, plane)) or outline_of(page, table, plane).clear > MAJORITY


def _in_view(plane: TablePlane, colour: Floats | None, band: Mask, own: Mask) -> Table | None:
    """Return the table on a plane in the view of a mesh.

    It is on all sides, and most of the rest is off it. Faces bridge the step.
    """
    if not _surrounds(plane.samples, band):
        return None
    coloured = None if colour is None else table_by_colour(colour, plane, band, own)
    if coloured is not None and not lies_on(coloured.plane, plane.measured & ~coloured.samples):
        return Table(coloured.samples)
    samples = table_by_depth(plane)
    return None if samples is None else Table(samples)


def _surrounds(on_plane: Mask, band: Mask) -> bool:
    """Return whether the plane is present on all four sides of the image.

    One side of a fold that fills the image is on three.
    """
    sides = (np.s_[:BORDER_BAND], np.s_[-BORDER_BAND:], np.s_[:, :BORDER_BAND], np.s_[:, -BORDER_BAND:])
    return all((on_plane & band)[side].sum() > MIN_FRACTION * band[side].sum() for side in sides)
