"""How wide the edges of a photograph are, in absolute terms."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from restore.numerics.srgb import NOISE_BLUR_PX
from restore.scan import Bytes

WINDOW = 31  # pixels: holds an edge up to five pixels of blur with both its sides
STRIDE = 8  # pixels
STRONGEST = 0.9  # quantile of contrast: the edges of page, card and black print
OF_DIFFERENCE = 4 / 12  # variance of the blur of a central difference, which is a box of two pixels
OF_A_STEP = float(np.sqrt(2 * np.pi))  # contrast over greatest slope of a step, in standard deviations of its blur


@dataclass(frozen=True)
class Sharpness:
    """Sharpness of the strongest edges of a photograph.

    blur: standard deviation in pixels.
    contrast: in 8-bit codes.
    """

    blur: float
    contrast: float


def sharpness(grey: Bytes) -> Sharpness:
    """Measure blur and contrast of the strongest edges in the direction of least blur.

    A step blurred by a Gaussian of standard deviation s has a slope of its contrast over s √(2π).
    grey: (h, w).
    """
    smooth = cv2.GaussianBlur(grey.astype(np.float32), (0, 0), NOISE_BLUR_PX)
    slope = np.hypot(*(cv2.Sobel(smooth, cv2.CV_32F, *way, ksize=3, scale=1 / 8) for way in ((1, 0), (0, 1))))
    kernel, each = np.ones((WINDOW, WINDOW), np.uint8), np.s_[WINDOW // 2 :: STRIDE, WINDOW // 2 :: STRIDE]
    contrast = (cv2.dilate(smooth, kernel) - cv2.erode(smooth, kernel))[each]
    steepest = cv2.dilate(slope, kernel)[each]
    strong = contrast >= np.quantile(contrast, STRONGEST)
    width = float(np.median(contrast[strong] / np.maximum(steepest[strong], 1e-6))) / OF_A_STEP
    return Sharpness(
        float(np.sqrt(max(width**2 - NOISE_BLUR_PX**2 - OF_DIFFERENCE, 0.0))), float(np.median(contrast[strong]))
    )
