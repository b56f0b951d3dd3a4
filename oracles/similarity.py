"""Multi-scale structural similarity of two pictures.

Z. Wang, E. P. Simoncelli, A. C. Bovik, "Multi-scale structural similarity for image quality assessment", 37th Asilomar
Conference (2003): contrast and structure at five scales, luminance at the coarsest, each to its weight (eq. 7). Windows
and constants as in Wang, Bovik, Sheikh, Simoncelli, "Image quality assessment: from error visibility to structural
similarity", IEEE TIP 13(4), 2004.
"""

from __future__ import annotations

import cv2
import numpy as np

from restore.scan import Bytes, Floats

WEIGHTS = (0.0448, 0.2856, 0.3001, 0.2363, 0.1333)  # of the scales, the finest first
WINDOW, SIGMA = 11, 1.5  # pixels
K1, K2, RANGE = 0.01, 0.03, 255.0
# The benchmark of flattened photographs compares pictures scaled to this many pixels (K. Ma et al., "DocUNet", CVPR
# 2018).
AREA = 598_400
REACH_PX = 24  # 4 mm at 150 dpi: a page that lies farther off has more on it than the page


def align_page(page: Bytes, flat: Bytes) -> Floats:
    """(2, 3) move and turn, without scale, by which a page (h, w, 3) agrees best with its flat original (H, W, 3).

    Where a page lies in its picture is no fault of the picture: the outline of what was scanned is ragged, and half a
    millimetre of it moves the corner. The light on the page must be even: gradients of it would be aligned too.
    """
    height, width = flat.shape[:2]
    grey, other = (cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY) for picture in (flat, page))
    canvas = np.full_like(grey, 255)
    rows, cols = min(height, other.shape[0]), min(width, other.shape[1])
    canvas[:rows, :cols] = other[:rows, :cols]
    ending = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 100, 1e-6)
    inner = grey[REACH_PX:-REACH_PX, REACH_PX:-REACH_PX]
    _, _, _, (left, top) = cv2.minMaxLoc(cv2.matchTemplate(canvas, inner, cv2.TM_CCOEFF_NORMED))
    start = np.array([[1, 0, left - REACH_PX], [0, 1, top - REACH_PX]], np.float32)
    _, found = cv2.findTransformECC(grey, canvas, start, cv2.MOTION_EUCLIDEAN, ending, None, 5)
    return np.asarray(found, float)


def lay_on(page: Bytes, motion: Floats, flat: Bytes) -> Bytes:
    """The page moved by a motion (2, 3) to where its flat original (H, W, 3) lies."""
    how, size = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP, flat.shape[1::-1]
    return np.asarray(cv2.warpAffine(page, motion, size, flags=how, borderMode=cv2.BORDER_REPLICATE), np.uint8)


def page_similarity(page: Bytes, flat: Bytes) -> float:
    """MS-SSIM of a page (h, w, 3) uint8 with its flat original (H, W, 3), in grey, both scaled to AREA pixels."""
    height, width = flat.shape[:2]
    scale = np.sqrt(AREA / (height * width))
    size = round(width * scale), round(height * scale)
    return ms_ssim(
        *(cv2.resize(cv2.cvtColor(x, cv2.COLOR_RGB2GRAY), size, interpolation=_by(x, size)) for x in (page, flat))
    )


def ms_ssim(a: Bytes, b: Bytes) -> float:
    """MS-SSIM of two grey pictures (h, w), 1 for equal ones. Their sides must be 16 windows or more: 176 pixels."""
    x, y = a.astype(np.float64), b.astype(np.float64)
    product = 1.0
    for scale, weight in enumerate(WEIGHTS):
        luminance, structure = _terms(x, y)
        last = scale == len(WEIGHTS) - 1
        # Negative correlation has no real power; it is no likeness at all.
        product *= max(float(((luminance * structure) if last else structure).mean()), 0.0) ** weight
        x, y = (_halved(picture) for picture in (x, y))
    return product


def _terms(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Luminance, and contrast times structure, in every window that lies within the pictures."""
    mean_x, mean_y = _blurred(x), _blurred(y)
    var_x, var_y = _blurred(x * x) - mean_x**2, _blurred(y * y) - mean_y**2
    both = _blurred(x * y) - mean_x * mean_y
    c1, c2 = (K1 * RANGE) ** 2, (K2 * RANGE) ** 2
    luminance = (2 * mean_x * mean_y + c1) / (mean_x**2 + mean_y**2 + c1)
    return luminance, (2 * both + c2) / (var_x + var_y + c2)


def _blurred(x: Floats) -> Floats:
    reach = WINDOW // 2
    return np.asarray(cv2.GaussianBlur(x, (WINDOW, WINDOW), SIGMA)[reach:-reach, reach:-reach])


def _halved(x: Floats) -> Floats:
    return np.asarray(cv2.blur(x, (2, 2), anchor=(0, 0))[: x.shape[0] // 2 * 2 : 2, : x.shape[1] // 2 * 2 : 2])


def _by(picture: Bytes, size: tuple[int, int]) -> int:
    return cv2.INTER_AREA if picture.shape[1] > size[0] else cv2.INTER_CUBIC
