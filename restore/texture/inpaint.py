"""Hidden pixels of the page: blank, or inpainted where they are narrow."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from restore.scan import Bytes, Mask
from restore.texture.coverage import Coverage, CoverageClass
from restore.texture.page import MM_PER_INCH, PAPER

STROKE_MM = 2.5  # of a title; those of running text are half a millimetre


def blank_hidden(image: Bytes, coverage: Coverage) -> Bytes:
    """The page (h, w, 3) with hidden pixels white, as off the page."""
    hidden = coverage.seen == CoverageClass.OCCLUDED
    if not hidden.any():
        return image
    blanked = image.copy()
    blanked[hidden] = PAPER
    return blanked


def inpaint_hidden(image: Bytes, coverage: Coverage, dpi: float, widest_mm: float) -> tuple[Bytes, Coverage]:
    """Inpaint hidden regions of a page up to `widest_mm` wide.

    Strokes of ink are removed before, or letters would be extended to other letters; paper and broad areas are not. A.
    Telea, "An image inpainting technique based on the fast marching method", J. Graphics Tools 9(1), 2004.
    image: (h, w, 3).
    Returns the page, and the coverage that marks the regions INPAINTED.
    """
    hidden = coverage.seen == CoverageClass.OCCLUDED
    if widest_mm == 0 or not hidden.any():
        return image, coverage
    pieces, count = label(hidden, np.ones((3, 3)))
    depth = cv2.distanceTransform(hidden.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    half_widths = np.zeros(count + 1)
    np.maximum.at(half_widths, pieces.ravel(), depth.ravel())
    narrow = half_widths * 2 <= widest_mm / MM_PER_INCH * dpi + 1
    narrow[0] = False
    selected = narrow[pieces]
    # Pixels off the page are unknown too: their white must not be propagated into the hole.
    unknown = (~coverage.mask).astype(np.uint8)
    filled = _inpaint(_close_strokes(image, unknown, dpi), unknown, selected)
    seen = np.where(selected, np.uint8(CoverageClass.INPAINTED), coverage.seen)
    return np.where(selected[..., None], filled, image), replace(coverage, seen=seen)


def _close_strokes(image: Bytes, unknown: NDArray[np.uint8], dpi: float) -> Bytes:
    """Close the known pixels of a page (h, w, 3) morphologically over strokes of print."""
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * round(STROKE_MM / MM_PER_INCH * dpi / 2) + 1,) * 2)
    unknown_pixels = (unknown > 0)[..., None]
    brightest = cv2.dilate(np.where(unknown_pixels, np.uint8(0), image), kernel)
    return np.asarray(cv2.erode(np.where(unknown_pixels, np.uint8(PAPER), brightest), kernel), np.uint8)


def _inpaint(image: Bytes, unknown: NDArray[np.uint8], selected: Mask) -> Bytes:
    """Inpaint a page (h, w, 3) in the selected regions, one bounding box at a time."""
    out = image.copy()
    margin = 8  # pixels of surroundings, more than the radius of the method
    boxes, count = label(cv2.dilate(selected.astype(np.uint8), np.ones((3, 3), np.uint8)))
    for number in range(1, count + 1):
        rows, cols = np.nonzero(boxes == number)
        part = (
            slice(max(0, rows.min() - margin), rows.max() + margin + 1),
            slice(max(0, cols.min() - margin), cols.max() + margin + 1),
        )
        out[part] = cv2.inpaint(np.ascontiguousarray(image[part]), unknown[part].copy(), 3, cv2.INPAINT_TELEA)
    return out
