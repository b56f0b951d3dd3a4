"""Divide light and shadow out of the page.

The paper's way: ink is masked, the paper's brightness is continued under it by a smooth surface, and the page is
divided by that surface (Zhang, Yip & Tan, "Removing shading distortions in camera-based document images", 2007).
"""

from __future__ import annotations

import cv2
import numpy as np

from restore.scan import Bytes, Floats, Mask
from restore.texture import MM_PER_INCH

COARSE_DPI = 30.0  # shading is smooth: finer grids cost time and gain nothing
LOCAL_MM = 20.0  # the brightest thing within this distance is paper
PAPER_SHARE = 0.8  # of that brightness: darker is ink or picture
SMOOTHING_MM = 4.0  # width of the surface: follows a fold's shadow, not a letter
FAR_MM = 25.0  # across figures larger than the smoothing, the surface is carried from this far
MAX_GAIN = 4.0  # a deeper shadow holds no picture to bring back, only noise
TINY = 1e-6


def remove_shading(image: Bytes, mask: Mask, dpi: float) -> Bytes:
    """Even out the light of a page (h, w, 3) uint8; outside mask (h, w) nothing changes."""
    size = tuple(max(1, round(extent * COARSE_DPI / dpi)) for extent in image.shape[1::-1])
    inside = cv2.resize(mask.astype(np.float64), size, interpolation=cv2.INTER_AREA)
    seen = cv2.resize(np.where(mask[..., None], image, 0).astype(np.float64), size, interpolation=cv2.INTER_AREA)
    colour = seen / np.maximum(inside, TINY)[..., None]
    light = _surface(colour, _paper(colour.max(axis=2), inside > 0.5))
    white = np.percentile(light[inside > 0.5].max(axis=1), 95) if (inside > 0.5).any() else 255.0
    gain = np.clip(white / np.maximum(light, TINY), 1.0 / MAX_GAIN, MAX_GAIN)
    full = cv2.resize(gain, image.shape[1::-1], interpolation=cv2.INTER_CUBIC)
    evened = np.clip(image * full + 0.5, 0, 255).astype(np.uint8)
    return np.where(mask[..., None], evened, image)


def _paper(brightness: Floats, inside: Mask) -> Floats:
    """1.0 where the page shows bare paper: as bright as its surroundings, and not as dark as the deepest shadow."""
    white = np.percentile(brightness[inside], 95) if inside.any() else 0.0
    reach = 2 * round(LOCAL_MM / MM_PER_INCH * COARSE_DPI / 2) + 1
    brightest = cv2.dilate(np.where(inside, brightness, 0.0), np.ones((reach, reach), np.uint8))
    return (inside & (brightness > np.maximum(PAPER_SHARE * brightest, white / MAX_GAIN))).astype(np.float64)


def _surface(colour: Floats, paper: Floats) -> Floats:
    """The paper's colour (h, w, 3), smooth and continued under ink and figures."""
    pixels_per_mm = COARSE_DPI / MM_PER_INCH
    total, weight = np.zeros_like(colour), np.zeros_like(paper)
    for width, share in ((SMOOTHING_MM, 1.0), (FAR_MM, 1e-3)):
        sigma = width * pixels_per_mm
        total += share * cv2.GaussianBlur(colour * paper[..., None], (0, 0), sigma)
        weight += share * cv2.GaussianBlur(paper, (0, 0), sigma)
    mean = (colour * paper[..., None]).sum(axis=(0, 1)) / max(float(paper.sum()), TINY)
    surface: Floats = (total + TINY * mean) / (weight + TINY)[..., None]  # where no paper is near, that of the page
    return surface
