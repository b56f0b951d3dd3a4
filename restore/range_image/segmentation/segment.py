"""Segment the sheet in a range image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numba
import numpy as np
from scipy.ndimage import binary_erosion, binary_fill_holes

from restore.camera.rays import MAX_GAP, MAX_SLOPE, STEEP, Rays
from restore.errors import NotEnoughSurface
from restore.findings import NOTABLE, Finding
from restore.numerics.robust import MAJORITY
from restore.range_image.gaps import gaps_of_rows
from restore.range_image.segmentation.outline import frame_of
from restore.range_image.segmentation.table import Table, find_table
from restore.scan import Floats, Ints, Mask, Provenance, RangeScan, with_findings

MIN_FRACTION = 0.02  # of the grid: a smaller piece is not a page
ANOTHER = 0.25  # of the largest surface: another page or leaf, or the rest of a torn one; a hand or a weight has less
SMALL_HINT = "move the scanner nearer or take a lens of longer focal length, so that the page fills more of the image"
SPARSE_HINT = "bring the page into the depth window, raise the laser power for dark paper, and scan again"
MAX_TOUCHING = 0.04  # of a page's outline on a table of its own colour: the corners of one that is flat elsewhere
CLOSING_DIAMETER = 2 * MAX_GAP + 1  # samples: wider than drop-outs, which leave notches in the outline
MAX_LOST = CLOSING_DIAMETER - 1  # samples in a row that a sheet goes on over: the outline is closed over as many
# The same next to a table that was measured, where nothing but the sheet can have lost them: across a side that is
# hollow, by a radius of 25 samples or more, it adds half a sample at most.
MAX_LOST_ON_TABLE = 10


@dataclass(frozen=True, eq=False)
class SegmentedScan:
    """Range image in which a sheet was found.

    scan: the whole of it.
    rays: of its image.
    samples: (rows, cols), those on the sheet.
    inside: (rows, cols), the sheet's whole area, its interior holes included.
    table: (rows, cols), those on the table below it; None where it was not looked for.
    """

    scan: RangeScan
    rays: Rays
    samples: Mask
    inside: Mask
    table: Mask | None = None

    @property
    def provenance(self) -> Provenance:
        """Of the scan."""
        return self.scan.provenance

    @property
    def fraction(self) -> float:
        """Of the picture that the sheet covers; small for a comb of single lines, too."""
        return float(min(self.samples.mean(), self.inside.mean()))

    @property
    def cut(self) -> float:
        """Return the fraction of the border that may be cut off.

        It lies in the first and last rows and columns with samples: the sheet may continue.
        """
        border = self.inside & ~binary_erosion(self.inside)
        return float((border & frame_of(self.scan.measured)).sum() / max(border.sum(), 1))


def segment(scan: RangeScan, rays: Rays, samples: Mask, *, lost: Mask | None = None) -> SegmentedScan:
    """Return the scan with a sheet of samples and of those lost between.

    samples, lost: (rows, cols).
    """
    return SegmentedScan(scan, rays, samples, fill_outline(samples if lost is None else samples | lost))


def find_sheet(scan: RangeScan, rays: Rays) -> SegmentedScan:
    """The scan with the largest connected surface off the table as its sheet.

    Its findings name others that could be pages, or how much is in smaller pieces: of dark ink or a steep part a weak
    laser measures nothing, and what lies beyond, at the edge of the picture, does not connect to the page.
    Raises NotEnoughSurface when no connected surface is large enough to be a page.
    """
    scan, table = _find_table(scan)
    samples = scan.measured & ~table.samples
    sheet = replace(largest_surface(scan, rays, samples), table=table.samples)
    if len(sheet.scan.findings) > len(scan.findings):  # it names others already
        return sheet
    return replace(sheet, scan=with_findings(sheet.scan, *_unconnected(samples, table, [sheet])))


def _unconnected(samples: Mask, table: Table, sheets: Sequence[SegmentedScan]) -> list[Finding]:
    """Return a finding where samples (rows, cols) connect to no sheet.

    Those of the table's colour do not count.
    """
    rest = samples & ~np.any([sheet.inside for sheet in sheets], axis=0)
    rest = rest if table.alike is None else rest & ~table.alike
    fraction = float(rest.sum() / sum(sheet.samples.sum() for sheet in sheets))
    return [Finding.of("unconnected", fraction)] if fraction > NOTABLE else []


def largest_surface(scan: RangeScan, rays: Rays, samples: Mask) -> SegmentedScan:
    """Return the scan with its largest connected surface as the sheet.

    Its findings name others that could be pages. Raises NotEnoughSurface when no surface is large enough to be a page.
    samples: (rows, cols).
    """
    labels, sizes = _label_connected_surfaces(scan, rays, samples)
    sheet = _labelled(scan, rays, samples, labels == max(int(np.argmax(sizes)), 1))
    if sheet.fraction < MIN_FRACTION:
        count = sheet.samples.sum()
        small = count < MIN_FRACTION * labels.size and count > MAJORITY * samples.sum()
        hint = SMALL_HINT if small else SPARSE_HINT
        raise NotEnoughSurface(f"the largest connected surface covers {sheet.fraction:.1%} of the image", hint)
    others = int((sizes >= max(ANOTHER * sizes.max(), MIN_FRACTION * labels.size)).sum()) - 1
    return sheet if others == 0 else replace(sheet, scan=_with_others(scan, others))


def _with_others(scan: RangeScan, others: int) -> RangeScan:
    surfaces = "another surface" if others == 1 else f"{others} other surfaces"
    return with_findings(scan, Finding.of("other_surfaces", surfaces=surfaces))


def find_pieces(scan: RangeScan, rays: Rays) -> list[SegmentedScan]:
    """Return the scan once for each surface that is connected, off the table and large."""
    scan, table = _find_table(scan)
    samples = scan.measured & ~table.samples
    labels, sizes = _label_connected_surfaces(scan, rays, samples)
    large = np.flatnonzero(sizes >= MIN_FRACTION * labels.size)
    pieces = [replace(_labelled(scan, rays, samples, labels == label), table=table.samples) for label in large]
    pieces = [piece for piece in pieces if piece.fraction >= MIN_FRACTION]
    said = _unconnected(samples, table, pieces) if pieces else []
    return [replace(piece, scan=with_findings(piece.scan, *said)) for piece in pieces]


def _labelled(scan: RangeScan, rays: Rays, samples: Mask, surface: Mask) -> SegmentedScan:
    """Return the scan with one labelled surface as its sheet.

    surface: (rows, cols), of its samples (rows, cols) and of those lost between them.
    """
    return segment(scan, rays, surface & samples, lost=surface & ~samples)


def _find_table(scan: RangeScan) -> tuple[RangeScan, Table]:
    table = find_table(scan, inverse_depths(scan), scan.measured)
    if table.touching > MAX_TOUCHING:
        scan = with_findings(scan, Finding.of("unseen_edge", table.touching))
    return scan, table


def inverse_depths(scan: RangeScan) -> Floats:
    """Return inverse depths (rows, cols) 1/mm, NaN where not measured."""
    return np.asarray(1.0 / np.where(scan.measured, -scan.points[..., 2], np.nan))


def _label_connected_surfaces(scan: RangeScan, rays: Rays, samples: Mask) -> tuple[Ints, Ints]:
    """Label the connected surfaces of samples (rows, cols).

    A surface has those of its samples, too, that were lost; they do not count for its size.
    Returns labels (rows, cols), 0 outside, and the sizes, 0 for that.
    """
    depth, goes_on = _over_lost(scan, rays, samples)
    labels = _label_connected(depth, goes_on, rays.dx * MAX_SLOPE)
    sizes = np.bincount(labels[samples], minlength=2)
    sizes[0] = 0
    return labels, sizes


def _over_lost(scan: RangeScan, rays: Rays, samples: Mask) -> tuple[Floats, Mask]:
    """Interpolate the depth of samples lost between others.

    A missing sample does not show where a sheet ends: one that was measured on the table does.
    Returns depth (rows, cols) mm of samples (rows, cols) and of those lost between them, and (rows, cols) True for
    both.
    """
    depth, measured = -scan.points[..., 2], scan.measured
    longest = MAX_LOST_ON_TABLE if (measured & ~samples).any() else MAX_LOST
    step = rays.dx * STEEP
    along = _interpolated(depth, samples, measured, longest, step)
    columns = np.ascontiguousarray(depth.T), np.ascontiguousarray(samples.T), np.ascontiguousarray(measured.T)
    down = _interpolated(*columns, longest, step).T
    filled = np.where(np.isfinite(along), along, down)
    lost = np.isfinite(filled)
    return np.where(lost, filled, depth), samples | lost


def fill_outline(samples: Mask) -> Mask:
    """Return the mask (rows, cols) with notches closed and holes filled.

    Nothing is added outside.
    """
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (CLOSING_DIAMETER, CLOSING_DIAMETER))
    # Padded: closing would otherwise bridge a notch to the border of the grid.
    closed = cv2.morphologyEx(np.pad(samples, CLOSING_DIAMETER).astype(np.uint8), cv2.MORPH_CLOSE, kernel)
    # An ellipse ends in single samples: it would leave specks as narrow before a straight side.
    # What is narrower than a gap is noise: in the row that an edge runs along some samples are counted as the sheet's.
    broad = cv2.morphologyEx(
        binary_fill_holes(closed).astype(np.uint8), cv2.MORPH_OPEN, np.ones((MAX_GAP + 1, MAX_GAP + 1), np.uint8)
    )
    opened = cv2.morphologyEx(broad, cv2.MORPH_OPEN, kernel)
    filled: Mask = opened[CLOSING_DIAMETER:-CLOSING_DIAMETER, CLOSING_DIAMETER:-CLOSING_DIAMETER].astype(bool)
    return filled


def _interpolated(depth: Floats, samples: Mask, measured: Mask, longest: int, step: float) -> Floats:
    """Interpolate depth over gaps of up to `longest` samples in a row.

    The samples at both ends differ by less than `step`·depth for each of the gap. Returns (rows, cols) mm, NaN
    elsewhere.
    """
    last, following = gaps_of_rows(measured)
    apart, before = following - last, depth.ravel()[last]
    change = (depth.ravel()[following] - before) / apart
    one_surface = samples.ravel()[last] & samples.ravel()[following] & (np.abs(change) < step * before)
    bridged = np.flatnonzero((apart <= longest + 1) & one_surface)
    lost = apart[bridged] - 1
    gap = np.repeat(bridged, lost)
    place = np.arange(1, len(gap) + 1) - np.repeat(np.cumsum(lost) - lost, lost)  # 1, 2, … in each gap
    filled = np.full(depth.size, np.nan)
    filled[last[gap] + place] = before[gap] + place * change[gap]
    return filled.reshape(depth.shape)


def _label_connected(depth: Floats, measured: Mask, step: float) -> Ints:
    """Label connected pieces, (rows, cols), 0 outside.

    Neighbours differ by less than `step`·depth per sample.
    """
    labels = np.zeros(depth.shape, np.int64)
    stack = np.empty((depth.size, 2), np.int64)
    _label(np.ascontiguousarray(depth), np.ascontiguousarray(measured), step, labels, stack)
    return labels


@numba.njit(cache=True)
def _label(depth: Floats, measured: Mask, step: float, labels: Ints, stack: Ints) -> None:
    """Write labels (rows, cols) in the order of the rows.

    labels: 0 at first.
    stack: (rows · cols, 2), scratch.
    """
    rows, cols = depth.shape
    label = 0
    for row in range(rows):
        for col in range(cols):
            if not measured[row, col] or labels[row, col]:
                continue
            label += 1
            labels[row, col], stack[0, 0], stack[0, 1], top = label, row, col, 1
            while top:
                top -= 1
                r, c = stack[top, 0], stack[top, 1]
                here = depth[r, c]
                for i in range(max(0, r - MAX_GAP), min(rows, r + MAX_GAP + 1)):
                    for j in range(max(0, c - MAX_GAP), min(cols, c + MAX_GAP + 1)):
                        if not measured[i, j] or labels[i, j]:
                            continue
                        reach = max(abs(i - r), abs(j - c))
                        if abs(depth[i, j] - here) < step * reach * here:
                            labels[i, j], stack[top, 0], stack[top, 1] = label, i, j
                            top += 1
