"""Packs several pictures of one sheet into one.

Programs write several for large models.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, sqrt
from pathlib import Path

import numpy as np

from restore.errors import BadInput
from restore.formats.parsing.picture import MAX_PIXELS
from restore.formats.parsing.tiles import in_first_tile
from restore.scan import Bytes, Floats, Ints

MARGIN = 4  # pixels round each picture that repeat its border: a cubic kernel reads two
MAX_PICTURES = 64


def pack(path: Path, pictures: Sequence[Bytes], uv: Floats, picture_of: Ints, faces: Ints) -> tuple[Bytes, Floats]:
    """Pack pictures (h, w, 3) into one, with its texture coordinates.

    picture_of: (n,), the picture that the coordinates uv (n, 2), v up, of each vertex are in.
    faces: (m, 3), never go from one picture to another.
    Returns the picture and the coordinates (n, 2). Raises BadInput for too many pictures or pixels.
    """
    cols = ceil(sqrt(len(pictures)))
    rows = ceil(len(pictures) / cols)
    height, width = (max(picture.shape[axis] for picture in pictures) + 2 * MARGIN for axis in (0, 1))
    if len(pictures) > MAX_PICTURES or rows * height * cols * width > MAX_PIXELS:
        raise BadInput(f"{path} has {len(pictures)} images with too many pixels in all", "scale them down")
    sheet = np.full((rows * height, cols * width, 3), 128, np.uint8)
    moved = np.array(uv, np.float64)
    for k, picture in enumerate(pictures):
        top, left = k // cols * height, k % cols * width
        bordered = np.pad(picture, ((MARGIN, MARGIN), (MARGIN, MARGIN), (0, 0)), mode="edge")
        sheet[top : top + bordered.shape[0], left : left + bordered.shape[1]] = bordered
        own = picture_of == k
        number = np.cumsum(own) - 1
        u, v = in_first_tile(path, moved[own], number[faces[own[faces[:, 0]]]]).T
        x, y = left + MARGIN + u * picture.shape[1], top + MARGIN + (1.0 - v) * picture.shape[0]
        moved[own] = np.column_stack([x / sheet.shape[1], 1.0 - y / sheet.shape[0]])
    return sheet, moved
