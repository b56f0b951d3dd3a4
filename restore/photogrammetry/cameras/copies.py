"""Smaller copies of photographs, in which patches and edges are measured."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from restore.photo.photograph import Photograph

SMOOTHING_PX = 0.6  # standard deviation: a camera's pixels alias more than that

Copies = NDArray[np.float32]
"""Brightness (v, h, w)."""


def smoothed_copies(photographs: Sequence[Photograph], side: int) -> Copies:
    """Return smoothed brightness of photographs, in smaller copies.

    Both directions are shrunk by one ratio, that of the widths: whole pixels of the height would differ from it.
    side: maximum of the longer side of a copy.
    Returns (v, h, w).
    """
    height, width = photographs[0].image.shape[:2]
    ratio = round(width * min(1.0, side / max(height, width))) / width
    return np.stack([_copy(photograph, ratio) for photograph in photographs])


def _copy(photograph: Photograph, ratio: float) -> Copies:
    grey = cv2.cvtColor(photograph.image, cv2.COLOR_RGB2GRAY)
    if ratio < 1.0:
        grey = cv2.resize(grey, None, fx=ratio, fy=ratio, interpolation=cv2.INTER_AREA)
    return cv2.GaussianBlur(grey.astype(np.float32), (0, 0), SMOOTHING_PX)
