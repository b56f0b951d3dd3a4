"""A picture on the coarse page: where each place lies in it, and what it shows there.

All pictures of a page have one resolution there, and can be compared.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import cv2
import numpy as np
from numpy.typing import NDArray

from restore.scan import Bytes, Floats, Mask
from restore.texture.page import MM_PER_INCH

COARSE_DPI = 30.0  # 0.85 mm: seams are wider than that
COARSE_MM = MM_PER_INCH / COARSE_DPI
NARROW_SIGMA = 6.0  # pixels: the average over a pixel adds a 400th to the variance of such a blur
OVERSAMPLING = 1.2  # of the smaller copies that are read for it
RESOLVED = 0.7  # pixels of a copy to one of the coarse page: with half, lines 4 mm apart keep 0.4 of their contrast


def blurred_widely(values: Floats, sigma: float) -> Floats:
    """Blur values by a Gaussian, in a smaller copy where it is wide.

    values: (h, w) or (h, w, k).
    sigma: pixels.
    """
    shrink = max(sigma / NARROW_SIGMA, 1.0)
    height, width = values.shape[:2]
    size = ceil(width / shrink), ceil(height / shrink)
    small = cv2.resize(values, size, interpolation=cv2.INTER_AREA)
    sigmas = sigma * size[0] / width, sigma * size[1] / height
    blurred = cv2.GaussianBlur(small, (0, 0), sigmas[0], sigmaY=sigmas[1], borderType=cv2.BORDER_REFLECT)
    return np.asarray(cv2.resize(blurred, (width, height), interpolation=cv2.INTER_LINEAR), np.float64)


@dataclass(frozen=True, eq=False)
class Placed:
    """Image placed on the coarse page.

    It has its ppi (h, w), and its position in a smaller copy of size (w, h).
    """

    image: Bytes
    ppi: Floats
    size: tuple[int, int]
    where: NDArray[np.float32]

    @classmethod
    def at(cls, image: Bytes, pixels: Floats, good: Mask) -> Placed:
        """Place an image on the coarse page.

        pixels: (h, w, 2), where the page lies in the image.
        good: (h, w), where that is of use.
        """
        down, right = (np.gradient(pixels, axis=axis) for axis in (0, 1))
        area = np.abs(right[..., 0] * down[..., 1] - right[..., 1] * down[..., 0])
        ppi = np.nan_to_num(np.sqrt(area)) * COARSE_DPI
        usual = float(np.median(ppi[good])) if good.any() else COARSE_DPI
        shrink = min(1.0, OVERSAMPLING * COARSE_DPI / max(usual, 1.0))
        size = max(round(image.shape[1] * shrink), 1), max(round(image.shape[0] * shrink), 1)
        where = (pixels + 0.5) * (np.array(size) / image.shape[1::-1]) - 0.5
        return cls(image, ppi, size, np.nan_to_num(where, nan=-1.0).astype(np.float32))

    @property
    def resolved(self) -> Mask:
        """Return where a pixel of the copy is narrow enough to compare print.

        In the direction in which it is widest: on a wall that is seen flat it is several times as wide as usual. (h, w)
        """
        down, right = (np.gradient(self.where, axis=axis) for axis in (0, 1))
        area = right[..., 0] * down[..., 1] - right[..., 1] * down[..., 0]
        squares = (right**2 + down**2).sum(axis=-1)
        least = (squares - np.sqrt(np.maximum(squares**2 - 4 * area**2, 0))) / 2  # squared singular value
        return np.asarray(least > RESOLVED**2)

    def read(self, small: Floats | Bytes) -> Floats:
        """Return values (h, w, …) of a smaller picture on the coarse page."""
        values: Floats = cv2.remap(small, self.where, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return values


@dataclass(frozen=True, eq=False)
class CoarseView:
    """One source on the coarse page.

    good     (h, w) True where the page can be painted from it.
    ppi      (h, w) what it resolves.
    light    (h, w, 3) linear.
    covered  (h, w) True where something covers the page in it, or a lamp is mirrored.
    resolved (h, w) True where it shows print as finely as the coarse page does, not seen flat.
    """

    good: Mask
    ppi: Floats
    light: Floats
    covered: Mask
    resolved: Mask
