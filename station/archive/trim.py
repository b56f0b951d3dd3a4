"""Trim the strip of the facing page from a leaf."""

from __future__ import annotations

import numpy as np
from PIL import Image

from restore import BadInput, CoverageClass
from restore.scan import Bytes, Mask
from station.archive.volume import Page, StoredFile

Box = tuple[int, int, int, int]

MAJORITY = 0.5  # of the paper in a column: a strip along the spine is straight to a pixel


def own_box_of(page: Page, picture: StoredFile) -> Box | None:
    """Return the box of a leaf without the strip of the facing page, pixels of its picture.

    None for a page without such a strip, one that has no coverage map, and a master that was not cropped with it.
    Raises BadInput for a damaged map.
    """
    stem = picture.path.name.removesuffix("-master.png").removesuffix(".png")  # none of an uncropped master
    file = next((one for one in page.files if one.path.name == f"{stem}-coverage.png"), None)
    if file is None or page.part == "page":
        return None
    try:
        with Image.open(file.path) as image:
            coverage = np.asarray(image)
    except (OSError, SyntaxError) as error:
        raise BadInput(f"{file.path} is not an image: {error}", "see planish verify") from error
    box = own_box(coverage)
    return None if box == (0, 0, *coverage.shape[::-1]) else box


def own_box(coverage: Bytes) -> Box:
    """Return left, top, right, bottom of what is not a strip of the facing page, pixels.

    coverage: (h, w), values of `CoverageClass`.

    >>> own_box(np.array([[1, 1, 6], [1, 1, 6]], np.uint8))
    (0, 0, 2, 2)
    """
    facing, paper = coverage == CoverageClass.FACING, coverage != CoverageClass.OUTSIDE
    left, right = _kept(facing, paper, 0)
    top, bottom = _kept(facing, paper, 1)
    return left, top, right, bottom


def _kept(facing: Mask, paper: Mask, axis: int) -> tuple[int, int]:
    """Return the first and one past the last line that is not of the strip, along an axis.

    Lines without paper outside the strip go with it.
    """
    strip = facing.sum(axis=axis) > MAJORITY * paper.sum(axis=axis)
    if not strip.any():
        return 0, len(strip)
    own = np.flatnonzero(~strip & (paper.sum(axis=axis) > 0))
    if own.size == 0:
        return 0, len(strip)
    first, last = np.flatnonzero(strip)[[0, -1]]
    return (int(last) + 1, len(strip)) if first < own[0] else (0, int(first))
