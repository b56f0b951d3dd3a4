"""Arranges the pieces of a torn page without overlap."""

from __future__ import annotations

from collections.abc import Sequence
from math import floor

import cv2
import numba
import numpy as np

from restore.mesh.raster import rasterise
from restore.scan import Floats, Ints, Mask

CELLS = 400  # of a side of the layout: the pieces come to lie at least one such cell apart


def arrange_pieces(flat: Floats, parts: Sequence[tuple[Ints, Ints]]) -> None:
    """Move pieces that overlap away from those before them, in place.

    The others stay where they are.
    flat: (n, 2) mm.
    parts: of each piece its vertices (k,) and its own faces (m, 3), the largest first.
    """
    if len(parts) < 2:
        return
    cell = float(np.ptp(flat, axis=0).max()) / CELLS
    taken, origin = np.zeros((1, 1), bool), np.zeros(2, int)
    centre: Floats = np.zeros(2)
    for count, (vertices, faces) in enumerate(parts):
        mask, corner = _footprint(flat[vertices], faces, cell)
        middle = corner + np.array(mask.shape) / 2
        way = middle - centre
        way = way / np.linalg.norm(way) if np.linalg.norm(way) > 0 else np.array([0.0, 1.0])
        shift = np.rint(_free_steps(taken, mask, *(corner - origin), *way) * way).astype(int)
        taken, origin = _with(taken, origin, mask, corner + shift)
        centre = centre + (middle + shift - centre) / (count + 1)
        flat[vertices] += cell * shift[::-1]


def _footprint(flat: Floats, faces: Ints, cell: float) -> tuple[Mask, Ints]:
    """Return the cells a piece covers, those it touches, and their corner.

    Both masks are (rows, cols); the corner is a cell (row, col).
    """
    corner = np.floor(flat.min(axis=0) / cell).astype(int) - 1
    pixels = flat / cell - corner - 0.5
    cols, rows = np.ceil(pixels.max(axis=0)).astype(int) + 2
    covered = np.isfinite(rasterise(pixels, faces, np.zeros((len(flat), 1)), rows, cols)[..., 0])
    return cv2.dilate(covered.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool), corner[::-1]


@numba.njit(cache=True)
def _free_steps(taken: Mask, mask: Mask, row: int, col: int, down: float, right: float) -> int:
    """Count the steps that a mask moves until it meets a taken cell.

    down, right: the step, a cell long.
    """
    steps = 0
    while _meets(taken, mask, row + floor(steps * down + 0.5), col + floor(steps * right + 0.5)):
        steps += 1
    return steps


@numba.njit(cache=True)
def _meets(taken: Mask, mask: Mask, row: int, col: int) -> bool:
    """Return whether a mask at a cell covers a taken one.

    Beyond the grid no cell is taken.
    """
    for i in range(max(0, -row), min(mask.shape[0], taken.shape[0] - row)):
        for k in range(max(0, -col), min(mask.shape[1], taken.shape[1] - col)):
            if mask[i, k] and taken[row + i, col + k]:
                return True
    return False


def _with(taken: Mask, origin: Ints, mask: Mask, corner: Ints) -> tuple[Mask, Ints]:
    """Return the taken cells with those of a mask added, and their corner.

    corner: (row, col) of the mask. The grid doubles as needed.
    """
    before = np.maximum(origin - corner, 0)
    after = np.maximum(corner + mask.shape - (origin + taken.shape), 0)
    if before.any() or after.any():
        room = np.array(taken.shape)
        grown = [(int(b and b + r), int(a and a + r)) for b, a, r in zip(before, after, room, strict=True)]
        taken, origin = np.pad(taken, grown), origin - np.array([b for b, _ in grown])
    row, col = corner - origin
    taken[row : row + mask.shape[0], col : col + mask.shape[1]] |= mask
    return taken, origin
