"""Lay the pieces of a torn page beside each other, none over another."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from restore.mesh.raster import rasterise
from restore.scan import Floats, Ints, Mask

CELLS = 400  # of a side of the layout: the pieces come to lie at least one such cell apart


def arrange_pieces(flat: Floats, parts: Sequence[tuple[Ints, Ints]]) -> None:
    """Move pieces that overlap away from those before them, in place; the rest stays where it is.

    flat (n, 2) mm; of each piece its vertices (k,) and its own faces (m, 3), the largest first.
    """
    if len(parts) < 2:
        return
    cell = float(np.ptp(flat, axis=0).max()) / CELLS
    taken: list[tuple[Mask, Ints]] = []
    for vertices, faces in parts:
        mask, corner = _footprint(flat[vertices], faces, cell)
        centre = np.mean([c + np.array(m.shape) / 2 for m, c in taken], axis=0) if taken else corner.astype(float)
        way = corner + np.array(mask.shape) / 2 - centre
        way = way / np.linalg.norm(way) if np.linalg.norm(way) > 0 else np.array([0.0, 1.0])
        steps = 0
        while any(_meet(mask, corner + np.rint(steps * way).astype(int), *other) for other in taken):
            steps += 1
        shift = np.rint(steps * way).astype(int)
        taken.append((mask, corner + shift))
        flat[vertices] += cell * shift[::-1]


def _footprint(flat: Floats, faces: Ints, cell: float) -> tuple[Mask, Ints]:
    """The cells (rows, cols) that a piece covers, and those that touch it; and the cell (row, col) of their corner."""
    corner = np.floor(flat.min(axis=0) / cell).astype(int) - 1
    pixels = flat / cell - corner - 0.5
    cols, rows = np.ceil(pixels.max(axis=0)).astype(int) + 2
    covered = np.isfinite(rasterise(pixels, faces, np.zeros((len(flat), 1)), rows, cols)[..., 0])
    return cv2.dilate(covered.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool), corner[::-1]


def _meet(mask: Mask, corner: Ints, other: Mask, other_corner: Ints) -> bool:
    low = np.maximum(corner, other_corner)
    high = np.minimum(corner + mask.shape, other_corner + other.shape)
    if (low >= high).any():
        return False
    one, two = (
        m[tuple(slice(a, b) for a, b in zip(low - c, high - c, strict=True))]
        for m, c in ((mask, corner), (other, other_corner))
    )
    return bool((one & two).any())
