"""The two leaves of an opened book whose gutter gave no range.

They are found as two sheets.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from restore.numerics.lines import MIN_POINTS, theil_sen
from restore.range_image.segmentation.segment import ANOTHER, SegmentedScan
from restore.scan import Floats, Ints, Mask

MAX_HIDDEN_MM = 40.0  # from edge to edge in space: of the deepest gutters of thick books
MAX_HEIGHT_RATIO = 1.1  # leaves of one book are cut at once; a corner that gave no range takes some of one edge
MAX_HEAD_STEP_MM = 5.0  # along the gap, between the heads of both leaves
CORNER_MM = 6.0  # from the line along an edge: a ragged gutter varies by less, head and tail run away from it


class HiddenGutter(NamedTuple):
    """A gutter without range data between two sheets of a range image.

    left, right  indices of the sheets.
    hidden_mm    median distance in space from edge to edge: at least as much paper is hidden.
    spine        (n, 2) texture pixels: the middle of the gap, from head to tail.
    """

    left: int
    right: int
    hidden_mm: float
    spine: Floats


def find_hidden_gutter(sheets: Sequence[SegmentedScan]) -> HiddenGutter | None:
    """Return the gutter between two sheets that are leaves of one book.

    Two are the sides of a gutter when they are neighbours in the image, of similar height, with their heads at one
    place along the gap, and near each other. The largest two are taken.
    sheets: of one scan, left to right.
    Returns None where no two qualify.
    """
    found = [gutter for right in range(1, len(sheets)) if (gutter := _gutter(sheets, right - 1, right)) is not None]
    return max(found, key=lambda gutter: _size(sheets[gutter.left]) + _size(sheets[gutter.right]), default=None)


def _size(sheet: SegmentedScan) -> int:
    return int(sheet.samples.sum())


def _gutter(sheets: Sequence[SegmentedScan], left: int, right: int) -> HiddenGutter | None:
    small, large = sorted([_size(sheets[left]), _size(sheets[right])])
    cols = _facing_cols(sheets[left].samples, sheets[right].samples)
    scan, rows = sheets[left].scan, np.arange(cols.shape[1])
    edges = [_along_line(scan.points[rows, at], at >= 0) for at in cols]
    both = np.isfinite(edges).all(axis=(0, 2))
    if small < ANOTHER * large or both.sum() < MIN_POINTS:
        return None
    (left_head, left_tail), (right_head, right_tail) = (_ends(edge) for edge in edges)
    down = left_tail - left_head + right_tail - right_head
    down /= np.linalg.norm(down)
    low, high = sorted([float((left_tail - left_head) @ down), float((right_tail - right_head) @ down)])
    hidden = float(np.median(np.linalg.norm((edges[1] - edges[0])[both], axis=1)))
    step = abs(float((left_head - right_head) @ down))
    if hidden > MAX_HIDDEN_MM or high > MAX_HEIGHT_RATIO * low or step > MAX_HEAD_STEP_MM:
        return None
    spine = np.mean([scan.texture_xy[rows, at] for at in cols], axis=0)[both]
    return HiddenGutter(left, right, hidden, spine)


def _facing_cols(left: Mask, right: Mask) -> Ints:
    """Return the columns that face each other over a gap, (2, rows).

    The last sample of a sheet (rows, cols) and the first of the next; −1 without one.
    """
    last, first = left.shape[1] - 1 - np.argmax(left[:, ::-1], axis=1), np.argmax(right, axis=1)
    return np.where([left.any(axis=1), right.any(axis=1)], [last, first], -1)


def _along_line(edge: Floats, known: Mask) -> Floats:
    """Return the edge (rows, 3) mm along its line, NaN elsewhere.

    It is NaN where unknown or round a corner, away from the line of most rows.
    """
    row = np.flatnonzero(known)
    if len(row) < MIN_POINTS:
        return np.full_like(edge, np.nan)
    slope, offset = theil_sen(row.astype(float), edge[row, 0])
    on_line = known & (np.abs(edge[:, 0] - slope * np.arange(len(edge)) - offset) <= CORNER_MM)
    return np.where(on_line[:, None], edge, np.nan)


def _ends(edge: Floats) -> tuple[Floats, Floats]:
    """Return the first and the last known point (3,) mm of an edge (rows, 3)."""
    known = np.flatnonzero(np.isfinite(edge[:, 0]))
    return edge[known[0]], edge[known[-1]]
