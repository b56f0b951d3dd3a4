"""Corrections of a restored page, made after it was textured.

Quarter turns and the crop.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from restore.edits.model import Crop, PartEdits
from restore.errors import NotEnoughSurface
from restore.orientation import rotate_page
from restore.page import RestoredPage
from restore.scan import Ints
from restore.texture.coverage import CoverageClass
from restore.texture.page import MM_PER_INCH, PAPER

EMPTY = {"image": PAPER, "master": PAPER, "coverage": CoverageClass.OUTSIDE, "mask": False, "page_source": 255}


def finish_page(page: RestoredPage, part: PartEdits) -> RestoredPage:
    """Return the page turned and cropped by hand, and report the corrections.

    Raises NotEnoughSurface for a crop that leaves nothing of the page.

    >>> corners = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 50.0, 0.0], [0.0, 50.0, 0.0]])
    >>> page = restore(SurfaceMesh(corners, np.array([[0, 1, 2], [0, 2, 3]])), Settings(dpi=30))
    >>> finish_page(page, PartEdits(turn=1)).image.shape
    (118, 59, 3)
    """
    page = crop_page(rotate_page(page, 90 * part.turn), part.crop)
    return replace(page, report={**page.report, "edits": part.model_dump(mode="json", exclude_defaults=True)})


def crop_page(page: RestoredPage, crop: Crop) -> RestoredPage:
    """Return the page with a margin, or the box that a crop names.

    Nothing is sampled again.
    """
    if crop.mode == "paper" or (crop.mode == "margin" and crop.margin_mm == 0):
        return page
    height, width = page.image.shape[:2]
    per_mm = page.dpi / MM_PER_INCH
    margin = crop.margin_mm * per_mm
    box = (-margin, -margin, width + margin, height + margin)
    if crop.box is not None and crop.mode == "box":
        left, top, right, bottom = (side * per_mm for side in crop.box)
        box = (max(left, -width), max(top, -height), min(right, 2.0 * width), min(bottom, 2.0 * height))
    edges = np.rint(box).astype(np.int64)
    if (edges[2:] <= np.maximum(edges[:2], 0)).any() or edges[0] >= width or edges[1] >= height:
        raise NotEnoughSurface("the crop leaves nothing of the page", "draw a box that lies on the page")
    cropped = page.changed_images(lambda name, values: _cropped(values, edges, EMPTY.get(name, np.nan)))
    size = [float(edges[2] - edges[0]) / per_mm, float(edges[3] - edges[1]) / per_mm]
    return replace(page, report={**page.report, "page_mm": size}, **cropped)


def _cropped(values: NDArray[Any], edges: Ints, empty: Any) -> NDArray[Any]:
    """Crop an array (h, w, …) to edges (left, top, right, bottom).

    The edges may lie outside it.
    """
    left, top, right, bottom = edges.tolist()
    height, width = values.shape[:2]
    cut = np.full((bottom - top, right - left, *values.shape[2:]), empty, values.dtype)
    rows, cols = slice(max(top, 0), min(bottom, height)), slice(max(left, 0), min(right, width))
    cut[rows.start - top : rows.stop - top, cols.start - left : cols.stop - left] = values[rows, cols]
    return cut
