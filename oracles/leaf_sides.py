"""Where on the true sheet a leaf of a spread ends, and which printed words it shows whole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.ndimage import map_coordinates

from drivers.simulated import Truth
from drivers.simulated.scene.artwork import Box
from drivers.simulated.scene.artwork.printed import MM_PER_PIXEL, Print
from oracles.layout import grid_positions
from restore import RangeScan, RestoredPage
from restore.scan import Floats

INK = 40  # levels below the paper, of any channel
NEXT_TO_SPINE_MM = 0.5  # on either side: what has ink within it is printed over the spine
ROWS = 400  # of a page at most that are looked at
HINGE_PX = 2  # from its last pixel, a page shows no mixture with what is outside


def inner_edge(page: RestoredPage, scan: RangeScan, truth: Truth, side: str) -> Floats:
    """(n, 2) mm on the sheet, x right, y up: the last that each row of a leaf shows towards the spine."""
    shown = np.isfinite(page.page_map[..., 0])
    rows = np.flatnonzero(shown.any(axis=1))[:: len(shown) // ROWS + 1]
    cols = shown.shape[1] - 1 - np.argmax(shown[rows, ::-1], axis=1) if side == "left" else shown[rows].argmax(axis=1)
    cols = cols + (-HINGE_PX if side == "left" else HINGE_PX)
    places = grid_positions(page.page_map[rows, cols].astype(float), scan)
    found = np.stack([map_coordinates(truth.flat[..., k], places, order=1, cval=np.nan) for k in (0, 1)], axis=1)
    found[:, 0] += (HINGE_PX if side == "left" else -HINGE_PX) * 25.4 / page.dpi
    found = found[np.isfinite(found).all(axis=1)]
    return found[np.argsort(found[:, 1])]


def boxes_cut(boxes: Sequence[Box], edges: Mapping[str, Floats]) -> int:
    """Return how many boxes (left, bottom, right, top) mm lie whole on none of the leaves; edges: by side, (n, 2)."""
    return sum(not any(_is_whole(box, edge, side) for side, edge in edges.items()) for box in boxes)


def _is_whole(box: Box, edge: Floats, side: str) -> bool:
    left, bottom, right, top = box
    at = np.interp(np.linspace(bottom, top, 5), edge[:, 1], edge[:, 0])
    return bool((right <= at).all() if side == "left" else (left >= at).all())


def printed_boxes(printed: Print) -> list[Box]:
    """The words of a page, and the fields of its pictures."""
    return [*(word.box for word in printed.words), *printed.patches.values()]


def is_printed_over(printed: Print, spine_mm: float) -> bool:
    """Whether ink lies on both sides of the spine next to it, at the same height."""
    dark = (printed.image.max(axis=(0, 1)).astype(int) - printed.image).max(axis=2) > INK
    middle, reach = (round(at / MM_PER_PIXEL) for at in (spine_mm, NEXT_TO_SPINE_MM))
    left, right = dark[:, middle - reach : middle], dark[:, middle : middle + reach]
    return bool((left.any(axis=1) & right.any(axis=1)).any())
