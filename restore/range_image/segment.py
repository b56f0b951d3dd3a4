"""Segment the sheet in a range image."""

from __future__ import annotations

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


def find_sheet(scan: RangeScan, rays: Rays, *, framed: bool = True) -> tuple[Mask, Mask]:
    """The samples that lie on the sheet, and the sheet's whole area with its interior holes: two masks (rows, cols).

    `framed` is True when the border of the grid is the border of the scanner's picture.
    Raises NotEnoughSurface when no connected surface is large enough to be a page.
    """
    labels, measured = _label_off_table(scan, rays, framed=framed)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0  # samples without a piece
    samples = measured & (labels == int(np.argmax(sizes)))
    inside = fill_outline(samples)
    share = min(samples.mean(), inside.mean())  # for a comb of single lines the second is small
    if share < MIN_SHARE:
        small = samples.mean() < MIN_SHARE and samples.sum() > ONE_PIECE * measured.sum()
        raise NotEnoughSurface(
            f"the largest connected surface covers {share:.1%} of the picture", SMALL_HINT if small else SPARSE_HINT
        )
    return samples, inside


def find_pieces(scan: RangeScan, rays: Rays, *, framed: bool = True) -> list[Mask]:
    """Samples (rows, cols) of every connected surface off the table that is large enough to be a page.

    `framed` as for `find_sheet`.
    """
    labels, measured = _label_off_table(scan, rays, framed=framed)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    pieces = [measured & (labels == label) for label in np.flatnonzero(sizes >= MIN_SHARE * labels.size)]
    return [piece for piece in pieces if fill_outline(piece).mean() >= MIN_SHARE]


def _label_off_table(scan: RangeScan, rays: Rays, *, framed: bool) -> tuple[Ints, Mask]:
    """Labels of the connected pieces off the table, 0 for none, and the samples off the table: both (rows, cols)."""
    measured = scan.measured
    inverse_depth = 1.0 / np.where(measured, -scan.points[..., 2], np.nan)
    measured = measured & ~find_table(scan, inverse_depth, measured, framed=framed)
    return _label_connected(1.0 / inverse_depth, measured, rays.dx * MAX_SLOPE), measured


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
