"""Measures of a scan and its page.

Numbers, each with a unit, that a preset has limits for.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.vivid900.geometry.lenses import FAST, FINE, LENSES, depth_window
from restore import CoverageClass, Finding, RangeScan, RestoredPage, SurfaceMesh
from restore.scan import Bytes, Mask
from station.verdict.same_page import fingerprint

MM_PER_INCH = 25.4
STRONGEST = 0.02  # fraction of the page's pixels whose gradient is that of an edge: print covers five per cent and more
REACH_PX = 4  # within which an edge of up to two pixels' spread has risen: two standard deviations
# of the page's smaller side, at each border: there light that falls off in a gutter looks like an edge
MARGIN = 1 / 12
FLAT_LEVELS = 24.0  # grey levels that an edge must rise by: several times the sensor's noise
PRE_SMOOTH_PX = 0.7  # before differences are taken, and removed from the result: the sensor's noise is not an edge
DIFFERENCE_PX = 3**-0.5  # spread by a central difference, the mean slope over two pixels; taken out as well
WHITE, BLACK = 255, 0
MODES = {"fast": FAST, "fine": FINE}

Measures = dict[str, Any]


def measure(page: RestoredPage, scan: RangeScan | SurfaceMesh) -> Measures:
    """Return the measures of a page and its scan, None for those the scan does not allow."""
    coverage, texture, report = page.coverage, scan.texture, page.report
    inside = np.ones(coverage.shape, bool)
    for kind in (CoverageClass.OUTSIDE, CoverageClass.FACING, CoverageClass.ERASED):
        inside &= coverage != kind
    measured = coverage == CoverageClass.MEASURED
    return {
        "measured_fraction": float(measured.sum() / max(inside.sum(), 1)),
        "hole_mm": widest_place(inside & ~measured) * MM_PER_INCH / page.dpi,
        "cropped_fraction": report["coverage"]["cropped_fraction"],
        "depth_window_fraction": depth_window_fraction(scan) if isinstance(scan, RangeScan) else None,
        "smooth_strain_rms": float(report["strain"]["smooth_rms"]),
        "sampling_ppi": None if texture is None else report["sampling_ppi"],
        "blur_px": None if texture is None else blur_px(texture, seen_in(page.page_map, texture.shape[:2])),
        "clipped_fraction": None if texture is None else clipped_fraction(page.master, measured),
        "size_ci95_mm": max(size) if (size := report.get("size_mm_ci95")) else None,
        "fingerprint": fingerprint(page.image),
    }


def left_out_fraction(report: Mapping[str, Any]) -> float:
    """Return the relative size of the largest sheet that is not restored.

    As a fraction of the page's, 0 without one.
    report: of a run, with its findings.
    """
    left_out = ("largest_of_pieces", "large_sheet_left_out")
    return max((one.share or 0.0 for one in Finding.all_in(report) if one.code in left_out), default=0.0)


def measured(page: RestoredPage, scan: RangeScan | SurfaceMesh) -> dict[str, Measures]:
    """The field of a report that holds the measures of its page."""
    return {"measures": measure(page, scan)}


def widest_place(mask: Mask) -> float:
    """Width, in pixels, of the largest circle within a mask (h, w)."""
    if not mask.any():
        return 0.0
    padded = np.pad(mask.astype(np.uint8), 1)
    return 2.0 * float(cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE).max()) - 1.0


def depth_window_fraction(scan: RangeScan) -> float | None:
    """Return how far the surface reaches to an end of the depth window.

    0 in its centre, 1 at its end, the window in 1/depth. None unless the scan says with which lens, mode and distance
    it was captured, at one distance.
    """
    facts = scan.provenance
    lens, mode, distance = (
        LENSES.get(str(facts.get("lens"))),
        MODES.get(str(facts.get("mode"))),
        facts.get("distance_mm"),
    )
    if lens is None or mode is None or not isinstance(distance, int | float) or len(facts.get("distances_mm", [0])) > 1:
        return None
    near, far = depth_window(lens, mode, float(distance))
    inverse = -1.0 / scan.points[..., 2][scan.measured]
    middle, half = (1 / near + 1 / far) / 2, (1 / near - 1 / far) / 2
    return float(np.abs(inverse - middle).max() / half) if inverse.size else None


def seen_in(page_map: NDArray[np.float32], size: tuple[int, int]) -> Mask:
    """Return the texture pixels (h, w) that a page map shows, with those between them.

    page_map: (h', w', 2).
    """
    x, y = (np.rint(axis[np.isfinite(axis)]).astype(np.int32) for axis in cv2.split(page_map))
    mask = np.zeros(size, np.uint8)
    mask.reshape(-1)[np.clip(y, 0, size[0] - 1) * size[1] + np.clip(x, 0, size[1] - 1)] = 1
    return cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8)).astype(bool)


def blur_px(texture: Bytes, page: Mask) -> float | None:
    """Return the standard deviation of the sharpest edges' spread, pixels.

    An edge of height a that a Gaussian of width s has spread rises by a / (s √2π) at its steepest pixel. The median
    over the steepest pixels of the page; None without edges.
    texture: (h, w, 3).
    page: (h, w).
    """
    grey = cv2.GaussianBlur(cv2.cvtColor(texture, cv2.COLOR_RGB2GRAY).astype(np.float32), (0, 0), PRE_SMOOTH_PX)
    gradient = np.hypot(cv2.Scharr(grey, cv2.CV_32F, 1, 0), cv2.Scharr(grey, cv2.CV_32F, 0, 1)) / 32.0
    depth = cv2.distanceTransform(np.pad(page.astype(np.uint8), 1), cv2.DIST_C, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1]
    inner = depth > max(REACH_PX, 2 * MARGIN * float(depth.max()))
    if not inner.any():
        return None
    window = np.ones((2 * REACH_PX + 1,) * 2, np.uint8)
    height = cv2.dilate(grey, window) - cv2.erode(grey, window)
    steep = inner & (gradient >= np.quantile(gradient[inner], 1.0 - STRONGEST)) & (height > FLAT_LEVELS)
    if not steep.any():
        return None
    spread = float(np.median(height[steep] / (gradient[steep] * np.sqrt(2.0 * np.pi))))
    return float(np.sqrt(max(spread**2 - PRE_SMOOTH_PX**2 - DIFFERENCE_PX**2, 0.0)))


def clipped_fraction(image: Bytes, measured: Mask) -> float:
    """Return the fraction of the measured pixels that are clipped.

    A channel is full, or all are empty.
    image: (h, w, 3), of a page.
    measured: (h, w).
    """
    red, green, blue = cv2.split(image)
    brightest = cv2.max(cv2.max(red, green), blue)[measured]
    return float(((brightest == WHITE) | (brightest == BLACK)).mean()) if brightest.size else 0.0
