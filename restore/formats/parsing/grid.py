"""The range grid: texture coordinates of its samples, and the polygons between them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from restore.camera.rays import ASPECT_TOLERANCE
from restore.errors import BadInput
from restore.formats.parsing.source import DAMAGED, MAX_SAMPLES
from restore.scan import Bytes, Floats, Ints, Mask


def check_grid(path: Path, rows: int, cols: int) -> None:
    """Raise BadInput for a range grid of an impossible size.

    It has no samples or more than any scanner gives.
    """
    if rows < 1 or cols < 1 or rows * cols > MAX_SAMPLES:
        raise BadInput(f"{path}: a range grid of {rows} rows and {cols} columns cannot be", DAMAGED)


def samples_in_picture(path: Path, rows: int, cols: int, texture: Bytes | None) -> Floats:
    """Return the texture pixels (rows, cols, 2) of a range image, or of the grid itself.

    A FAST scan has a quarter of the picture's samples, each in the centre of its 2 × 2 pixels. Raises BadInput when
    grid and picture are not of one shape.
    """
    height, width = (rows, cols) if texture is None else texture.shape[:2]
    if abs(width * rows / (height * cols) - 1.0) > ASPECT_TOLERANCE:
        raise BadInput(
            f"{path}: the image of {width} × {height} pixels does not fit a range grid of {cols} × {rows} samples",
            "give the image of the same capture with planish restore --texture",
        )
    x = (np.arange(cols) + 0.5) * (width / cols) - 0.5
    y = (np.arange(rows) + 0.5) * (height / rows) - 0.5
    return np.stack(np.meshgrid(x, y), axis=-1)


def grid_polygons(measured: Mask) -> tuple[Ints, Ints]:
    """Return polygons between neighbouring measured samples.

    They run counter-clockwise seen by the scanner. The samples are numbered in raster order, top row first, the
    measured ones only: the way the scanner's own software writes them (VIVID-S VRML export).
    Returns quads (q, 4) and triangles (t, 3).
    """
    number = np.cumsum(measured.ravel()).reshape(measured.shape) - 1
    around = ((slice(None, -1), slice(None, -1)), (slice(1, None), slice(None, -1)), (slice(1, None), slice(1, None)),
              (slice(None, -1), slice(1, None)))  # fmt: skip
    corners = np.stack([number[at] for at in around], axis=-1).astype(np.int64)
    seen = np.stack([measured[at] for at in around], axis=-1)
    three = seen.sum(axis=-1) == 3
    return corners[seen.all(axis=-1)], corners[three][seen[three]].reshape(-1, 3)
