"""Outline of a page against its table: standing clear or touching."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from scipy.ndimage import binary_erosion, binary_fill_holes

from restore.camera.rays import EDGE_BLUR, STEEP
from restore.numerics.robust import OUTLYING
from restore.range_image.segmentation.plane import TablePlane
from restore.scan import Floats, Ints, Mask

STRIP = 6  # samples along the outline of a flat page, on both sides of it
MIN_SAMPLES = 100  # that determine a plane or a height: of a table of black cloth a tenth is measured
PAPER_MM = 0.05  # half the thickness of paper of 80 g/m²: dark ink may seem nearer or farther, by less
MIN_SHEET = 0.05  # of the samples, in one piece; the rest of a page that fills the picture is letters and lines


class PageOutline(NamedTuple):
    """Outline of a page next to its table, without the image's frame, where it continues.

    clear: fraction of it that stands clear of the table: the page, continuing as it does there, would not meet it.
    touching: fraction of it that touches the table.
    """

    clear: float
    touching: float


def page_on(table: Mask, plane: TablePlane) -> Mask:
    """Return the largest piece outside a table of samples (rows, cols), (rows, cols) bool."""
    return _largest(without_speckles(plane.measured & ~table))


def is_enclosed(page: Mask, measured: Mask) -> bool:
    """Return whether a page ends before the frame of the image.

    page: (rows, cols).
    measured: (rows, cols), which shows the frame.
    """
    return not (page & frame_of(measured)).any()


def frame_of(measured: Mask) -> Mask:
    """Return the outermost rows and columns with samples, and beyond.

    measured: (rows, cols). Returns (rows, cols) bool.
    """
    frame = np.ones_like(measured)
    rows, cols = (np.flatnonzero(measured.any(axis=axis)) for axis in (1, 0))
    frame[rows[0] + 1 : rows[-1], cols[0] + 1 : cols[-1]] = False
    return frame


def outline_of(page: Mask, table: Mask, plane: TablePlane) -> PageOutline:
    """Return the outline of a page (rows, cols) next to its table.

    table: (rows, cols), samples.
    """
    outline, apart = _bordering_table(table, page & ~binary_erosion(page, border_value=1) & plane.measured, page)
    height = plane.height[outline]
    on_page = np.where(page & plane.measured, plane.height, -np.inf)
    # Over 2 to 4 mm a page goes on as at its outline.
    highest = cv2.dilate(on_page, np.ones((2 * EDGE_BLUR + 1, 2 * EDGE_BLUR + 1)))[outline]
    clear = height - (highest - height) / EDGE_BLUR * apart > plane.tolerance
    # A page that touches its table rises from it less steeply, its edge more so.
    touching = height < plane.tolerance + STEEP * plane.pitch
    return PageOutline(*(float(some.sum() / max(some.size, 1)) for some in (clear, touching)))


def lies_above(page: Mask, table: Mask, plane: TablePlane) -> bool:
    """Return whether a page is as high above its table as paper is thick.

    The page lies flat on the table (rows, cols). Height is compared in strips along the outline, EDGE_BLUR samples from
    it: a table may be bowed by as much.
    page: (rows, cols).
    """
    inner, outer = (
        plane.height[samples & _within(other, EDGE_BLUR + STRIP) & ~_within(other, EDGE_BLUR)]
        for samples, other in ((page & plane.samples, ~page), (table, page))
    )
    if min(inner.size, outer.size) < MIN_SAMPLES:
        return False
    error = np.sqrt(inner.var() / inner.size + outer.var() / outer.size)
    return bool(inner.mean() - outer.mean() > max(PAPER_MM, OUTLYING * error))


def _within(mask: Mask, samples: int) -> Mask:
    """Return a mask (rows, cols) dilated by `samples`."""
    return cv2.dilate(mask.astype(np.uint8), np.ones((2 * samples + 1, 2 * samples + 1), np.uint8)).astype(bool)


def _bordering_table(table: Mask, outline: Mask, page: Mask) -> tuple[tuple[Ints, Ints], Floats]:
    """Return where an outline is next to a table, and how far, samples.

    No other part of the page is between them.
    table, outline, page: (rows, cols).
    Returns positions (k,) and distances (k,).
    """
    apart, nearest = _nearest(table)
    found, apart = np.argwhere(outline), apart[outline]
    ends = np.stack(np.unravel_index(nearest[outline], page.shape), axis=1)
    between = np.rint(0.5 * (found + ends)).astype(int)
    near = ~page[tuple(between.T)] | (apart < 2.0)
    return tuple(found[near].T), apart[near]


def _nearest(samples: Mask) -> tuple[Floats, Ints]:
    """Return distance and index of the nearest of samples (rows, cols).

    The distance (rows, cols) is to a hundredth, the index into the flat grid.
    """
    others = (~samples).astype(np.uint8)
    apart, number = cv2.distanceTransformWithLabels(
        others, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    index = np.zeros(int(number.max()) + 1, np.int64)
    index[number[samples]] = np.flatnonzero(samples)
    return apart, index[number]


def _largest(mask: Mask) -> Mask:
    """Return the largest connected piece of a mask (rows, cols)."""
    _, labels = cv2.connectedComponents(mask.astype(np.uint8))
    sizes = np.bincount(labels.ravel(), minlength=2)
    return np.asarray(labels == 1 + int(sizes[1:].argmax()))


def without_speckles(samples: Mask) -> Mask:
    """Return samples without speckles, gaps and holes.

    Gaps of one are closed, single samples removed, and enclosed areas filled. Returns (rows, cols) bool.
    """
    kernel = np.ones((3, 3), np.uint8)
    solid = cv2.morphologyEx(samples.astype(np.uint8), cv2.MORPH_CLOSE, kernel)
    return np.asarray(binary_fill_holes(cv2.morphologyEx(solid, cv2.MORPH_OPEN, kernel)))


def is_sheet(rest: Mask, measured: Mask) -> bool:
    """Return whether the largest connected piece may be a sheet.

    Links one or two samples wide do not connect. Where nothing was measured a piece continues as next to it: dark ink
    and a weak laser lose samples on paper, too.
    rest, measured: (rows, cols).
    """
    everywhere = rest.ravel()[_nearest(measured)[1]]
    solid = cv2.morphologyEx(everywhere.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    _, labels = cv2.connectedComponents(solid)
    return bool(np.bincount(labels[rest])[1:].max(initial=0) > MIN_SHEET * measured.sum())
