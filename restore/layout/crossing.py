"""Print that runs over a spine and must not be cut.

It is a picture or a line of text across an opening. The light in a gutter changes across it and hardly along it. Print
changes along it, too, or has another colour than the paper; it runs over the spine where it does so on both sides at
the same height.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from restore.mesh.triangulate import compact
from restore.numerics.robust import NEARLY_ALL
from restore.numerics.srgb import DARKEST, NOISE_BLUR_PX
from restore.page import FlatMesh
from restore.scan import Bytes, Floats, Mask
from restore.shading.paper import HUE
from restore.texture.page import MM_PER_INCH, page_map

DPI = 150.0  # finer than the scanner's own picture
REACH_MM = 3.0  # on either side of the spine: the narrowest margin of a book is wider
MARGIN_MM = 4.0  # at head and tail, where the page ends, and of the height over which the level is averaged
STEP = 0.02  # change from row to row, of the local level, that print makes and noise does not


def print_over_spine(fine: FlatMesh, place: Floats) -> float | None:
    """Return the fraction of the height at which print runs over a spine.

    place: (n, 2) mm on the flat page from its upper left corner, x right, y down, from head to tail.
    Returns None without a picture.
    """
    if fine.texture is None or fine.texcoords is None:
        return None
    strip, across = _strip(fine, place)
    if strip is None:
        return None
    known = np.isfinite(strip[..., 0])
    left, right = (known & (sign * across > 0) for sign in (-1, 1))
    picture = cv2.remap(fine.texture, np.nan_to_num(strip), None, cv2.INTER_LINEAR)
    paper = _paper_colour(fine)
    printed = [_steps(picture, side) | _coloured(picture, side, paper) for side in (left, right)]
    seen: Mask = np.asarray(left.any(axis=1) & right.any(axis=1))
    margin = round(MARGIN_MM * DPI / MM_PER_INCH)
    seen[:margin] = seen[len(seen) - margin :] = False
    return float((printed[0] & printed[1] & seen).sum() / max(seen.sum(), 1))


def _strip(fine: FlatMesh, place: Floats) -> tuple[NDArray[np.float32] | None, Floats]:
    """Return texture pixels (h, w, 2) of a straightened strip at the spine, None off the page.

    Returns also (w,) mm from the spine.
    """
    corner = np.array([fine.flat[:, 0].min(), fine.flat[:, 1].max()])
    down = corner[1] - fine.flat[:, 1]
    from_spine = fine.flat[:, 0] - corner[0] - np.interp(down, place[:, 1], place[:, 0])
    corners = from_spine[fine.faces]
    faces = fine.faces[(corners.min(axis=1) <= REACH_MM) & (corners.max(axis=1) >= -REACH_MM)]
    if len(faces) == 0:
        return None, np.empty(0)
    used, faces = compact(np.arange(len(from_spine)), faces)
    assert fine.texcoords is not None
    flat = np.column_stack([from_spine[used], -down[used]])
    strip = page_map(flat, faces, fine.texcoords[used], DPI)
    across = flat[:, 0].min() + (np.arange(strip.shape[1]) + 0.5) * MM_PER_INCH / DPI
    kept = np.abs(across) <= REACH_MM
    return np.ascontiguousarray(strip[:, kept]), across[kept]


def _steps(picture: Bytes, side: Mask) -> Mask:
    """Return the rows (h,) in which a side of a strip changes by more than noise does.

    picture: (h, w, 3).
    side: (h, w).
    """
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY).astype(np.float32)
    change = np.abs(cv2.Sobel(cv2.GaussianBlur(grey, (0, 0), NOISE_BLUR_PX), cv2.CV_32F, 0, 1, ksize=3)) / 8
    rows = int(MARGIN_MM * DPI / MM_PER_INCH) | 1
    level = cv2.blur(np.where(side, grey, 0.0), (1, rows)) / np.maximum(
        cv2.blur(side.astype(np.float64), (1, rows)), 1e-6
    )
    relative = np.where(side, change / np.maximum(level, DARKEST), np.nan)
    return _quantile(relative) > STEP


def _coloured(picture: Bytes, side: Mask, paper: Floats) -> Mask:
    """Return the rows (h,) in which a side has another colour than paper, brightness apart.

    picture: (h, w, 3).
    side: (h, w).
    paper: (3,).
    """
    values = picture.astype(float)
    total = values.sum(axis=2)
    away = np.abs(values / np.maximum(total, 1.0)[..., None] - paper).max(axis=2)
    return _quantile(np.where(side & (total > 3 * DARKEST), away, np.nan)) > HUE


def _quantile(values: Floats) -> Floats:
    """Return the value that a tenth of each row exceeds, (h,), 0 for a row without values.

    values: (h, w).
    """
    # numpy.nanpercentile goes row by row, for a quarter of the time of two leaves.
    count = np.isfinite(values).sum(axis=1)
    ordered, row = np.sort(values, axis=1), np.arange(len(values))
    place = NEARLY_ALL * np.maximum(count - 1, 0)
    below = place.astype(int)
    low, high = ordered[row, below], ordered[row, np.minimum(below + 1, np.maximum(count - 1, 0))]
    return np.where(count > 0, low + (high - low) * (place - below), 0.0)


def _paper_colour(fine: FlatMesh) -> Floats:
    """Return the fraction (3,) of each channel in the brighter half of the page."""
    assert fine.texture is not None and fine.texcoords is not None
    x, y = np.rint(fine.texcoords).astype(int).T
    height, width = fine.texture.shape[:2]
    colours = fine.texture[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)].astype(float)
    total = colours.sum(axis=1)
    bright = colours[total >= np.median(total)]
    return np.asarray(np.median(bright / np.maximum(bright.sum(axis=1), 1.0)[:, None], axis=0))
