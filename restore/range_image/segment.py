"""Segment the sheet in a range image."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numba
import numpy as np

from restore.errors import NotEnoughSurface
from restore.range_image.camera import Rays
from restore.range_image.table import find_table
from restore.scan import Floats, Ints, Mask, RangeScan

MAX_SLOPE = 6.0  # 80.5°: steeper than any wall that both camera and laser see, less steep than the step to the table
MAX_GAP = 2  # samples: drop-outs inside ink leave gaps of one or two
MIN_SHARE = 0.02  # of the grid: a smaller piece is no page
ONE_PIECE = 0.5  # of the samples off the table: with more in one piece the laser was strong enough
SMALL_HINT = "move the scanner nearer or take a lens of longer focal length, so that the page fills more of the picture"
SPARSE_HINT = "bring the page into the depth window, raise the laser power for dark paper, and scan again"
CLOSING_DIAMETER = 5  # samples: notches that ink leaves in the outline


@dataclass(frozen=True, eq=False)
class SegmentedScan:
    """A range image in which a sheet was found.

    scan     the whole of it.
    rays     of its picture.
    samples  (rows, cols) that lie on the sheet.
    inside   (rows, cols) the sheet's whole area, its interior holes included.
    """

    scan: RangeScan
    rays: Rays
    samples: Mask
    inside: Mask

    @property
    def provenance(self) -> Mapping[str, Any]:
        """Of the scan."""
        return self.scan.provenance

    @property
    def share(self) -> float:
        """Of the picture that the sheet covers; small for a comb of single lines, too."""
        return float(min(self.samples.mean(), self.inside.mean()))


def segment(scan: RangeScan, rays: Rays, samples: Mask) -> SegmentedScan:
    """The scan with the sheet of these samples (rows, cols)."""
    return SegmentedScan(scan, rays, samples, fill_outline(samples))


def find_sheet(scan: RangeScan, rays: Rays) -> SegmentedScan:
    """The scan with the largest connected surface off the table as its sheet.

    Raises NotEnoughSurface when no connected surface is large enough to be a page.
    """
    return largest_surface(scan, rays, _off_table(scan))


def largest_surface(scan: RangeScan, rays: Rays, samples: Mask) -> SegmentedScan:
    """The scan with the largest connected surface of some of its samples (rows, cols) as its sheet.

    Raises NotEnoughSurface when none is large enough to be a page.
    """
    labels, sizes = _label_connected_surfaces(scan, rays, samples)
    sheet = segment(scan, rays, labels == max(int(np.argmax(sizes)), 1))
    if sheet.share < MIN_SHARE:
        count = sheet.samples.sum()
        small = count < MIN_SHARE * labels.size and count > ONE_PIECE * samples.sum()
        hint = SMALL_HINT if small else SPARSE_HINT
        raise NotEnoughSurface(f"the largest connected surface covers {sheet.share:.1%} of the picture", hint)
    return sheet


def find_pieces(scan: RangeScan, rays: Rays) -> list[SegmentedScan]:
    """The scan with each connected surface off the table that is large enough to be a page as its sheet."""
    labels, sizes = _label_connected_surfaces(scan, rays, _off_table(scan))
    large = np.flatnonzero(sizes >= MIN_SHARE * labels.size)
    pieces = [segment(scan, rays, labels == label) for label in large]
    return [piece for piece in pieces if piece.share >= MIN_SHARE]


def _off_table(scan: RangeScan) -> Mask:
    """(rows, cols) the samples of a scanner's picture that are not on the table."""
    measured = scan.measured
    return measured & ~find_table(scan, inverse_depths(scan), measured)


def inverse_depths(scan: RangeScan) -> Floats:
    """(rows, cols) 1/mm, NaN where nothing was measured."""
    return np.asarray(1.0 / np.where(scan.measured, -scan.points[..., 2], np.nan))


def _label_connected_surfaces(scan: RangeScan, rays: Rays, samples: Mask) -> tuple[Ints, Ints]:
    """Labels (rows, cols) of the connected surfaces of samples (rows, cols), 0 for none, and their sizes, 0 for it."""
    labels = _label_connected(-scan.points[..., 2], samples, rays.dx * MAX_SLOPE)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return labels, sizes


def fill_outline(samples: Mask) -> Mask:
    """The mask (rows, cols) of samples with notches closed and interior holes filled, nothing added outside."""
    from scipy.ndimage import binary_fill_holes

    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (CLOSING_DIAMETER, CLOSING_DIAMETER))
    # Padded: closing would otherwise bridge a notch to the border of the grid.
    closed = cv2.morphologyEx(np.pad(samples, CLOSING_DIAMETER).astype(np.uint8), cv2.MORPH_CLOSE, kernel)
    opened = cv2.morphologyEx(binary_fill_holes(closed).astype(np.uint8), cv2.MORPH_OPEN, kernel)
    filled: Mask = opened[CLOSING_DIAMETER:-CLOSING_DIAMETER, CLOSING_DIAMETER:-CLOSING_DIAMETER].astype(bool)
    return filled


@numba.njit(cache=True)
def _label_connected(depth: Floats, measured: Mask, step: float) -> Ints:
    """(rows, cols) labels of connected pieces, 0 for none; neighbours differ by less than `step`·depth per sample."""
    rows, cols = depth.shape
    labels = np.zeros((rows, cols), np.int64)
    stack = np.empty((rows * cols, 2), np.int64)
    label = 0
    for row in range(rows):
        for col in range(cols):
            if not measured[row, col] or labels[row, col]:
                continue
            label += 1
            labels[row, col] = label
            stack[0] = row, col
            top = 1
            while top:
                top -= 1
                r, c = stack[top]
                for i in range(max(0, r - MAX_GAP), min(rows, r + MAX_GAP + 1)):
                    for j in range(max(0, c - MAX_GAP), min(cols, c + MAX_GAP + 1)):
                        if not measured[i, j] or labels[i, j]:
                            continue
                        reach = max(abs(i - r), abs(j - c))
                        if abs(depth[i, j] - depth[r, c]) < step * reach * depth[r, c]:
                            labels[i, j] = label
                            stack[top] = i, j
                            top += 1
    return labels
