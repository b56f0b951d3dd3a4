"""Reference of a photograph: the scanner's image and its surface points.

There is a surface point under each of its pixels.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from restore.mesh.raster import rasterise
from restore.page import FlatMesh
from restore.scan import Bytes, Floats, Mask

MAX_SIDE = 1024  # pixels: the scanner's image has 640; of larger textures a smaller copy gives the pose as well

SPARED = 4  # every fourth row suffices for the size of the pixels


@dataclass(frozen=True, eq=False)
class Reference:
    """The sheet as the scanner saw it.

    grey    (h, w) uint8, the page and what lies round it.
    points  (h, w, 3) float32 mm, the surface under each pixel, NaN off the page.
    """

    grey: Bytes
    points: NDArray[np.float32]

    @property
    def page(self) -> Mask:
        """Return where the reference shows the page, (h, w) bool."""
        return np.asarray(np.isfinite(self.points[..., 0]))

    @property
    def pixel_mm(self) -> float:
        """The paper under a pixel, median over the page."""
        steps = np.linalg.norm(np.diff(self.points[::SPARED], axis=1), axis=2)
        return float(np.median(steps[np.isfinite(steps)])) if np.isfinite(steps).any() else 0.0

    def at(self, pixels: Floats) -> Floats:
        """Return the surface (n, 3) mm under pixels (n, 2), NaN off the page.

        Pixels may have fractions.
        """
        where = pixels.astype(np.float32).reshape(-1, 1, 2)
        found = cv2.remap(
            self.points, where, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=(np.nan,) * 3
        )
        return np.asarray(found.reshape(-1, 3), dtype=np.float64)


def make_reference(page: FlatMesh) -> Reference:
    """The reference of a flat page that has a texture."""
    assert page.texture is not None and page.texcoords is not None
    height, width = page.texture.shape[:2]
    ratio = min(1.0, MAX_SIDE / max(height, width))
    size = (max(round(width * ratio), 1), max(round(height * ratio), 1))
    grey = cv2.resize(cv2.cvtColor(page.texture, cv2.COLOR_RGB2GRAY), size, interpolation=cv2.INTER_AREA)
    corners = (page.texcoords + 0.5) * (np.array(size) / [width, height]) - 0.5
    return Reference(grey, rasterise(corners, page.faces, page.vertices, size[1], size[0]))
