"""The page ends at the holes through it: what the picture shows there is the table."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from restore.findings import Finding, finding
from restore.page import FlatMesh
from restore.range_image.facets.sheet import Sheet
from restore.scan import Mask, SurfaceMesh
from restore.texture.coverage import Coverage, Seen
from restore.texture.page import MM_PER_INCH, PAPER, Painting, rasterise_on_page

HALF = 0.5  # of a sample: between one in a hole and one on the paper the edge is half-way
NO_PICTURE = 255  # in page_source, outside the page


def holes_on_page(surface: Sheet | SurfaceMesh, fine: FlatMesh, shape: tuple[int, ...], dpi: float) -> Mask:
    """(h, w) True in the holes of a surface, on its flat page of a shape (h, w) at a resolution of dpi."""
    if not isinstance(surface, Sheet) or surface.holes is None or not surface.holes.any():
        return np.zeros(shape, bool)
    places = np.stack(surface.rays.grid(fine.vertices), axis=1)[:, ::-1]
    grid_xy = rasterise_on_page(fine, places, shape, dpi)
    return np.asarray(cv2.remap(surface.holes.astype(np.float32), grid_xy, None, cv2.INTER_LINEAR) > HALF)


def end_at_holes(painting: Painting, coverage: Coverage, holes: Mask) -> tuple[Painting, Coverage]:
    """The painted page and its coverage, holes (h, w) blank and off the page."""
    if not holes.any():
        return painting, coverage
    image, source = painting.image.copy(), painting.source.copy()
    image[holes], source[holes] = PAPER, np.nan
    page_source = painting.page_source
    if page_source is not None:
        page_source = np.where(holes, np.uint8(NO_PICTURE), page_source)
    ended = replace(painting, image=image, mask=painting.mask & ~holes, source=source, page_source=page_source)
    return ended, Coverage(np.where(holes, np.uint8(Seen.OUTSIDE), coverage.seen))


def hole_findings(holes: Mask, dpi: float) -> list[Finding]:
    """What is to be reported of a page with holes (h, w)."""
    area = float(holes.sum()) * (MM_PER_INCH / dpi) ** 2
    return [finding("holes", area_mm2=area)] if area else []
