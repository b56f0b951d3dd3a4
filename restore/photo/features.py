"""Features that reference and photograph have in common.

SIFT (Lowe 2004), compared as RootSIFT (Arandjelović & Zisserman 2012). Print repeats itself: a letter looks like every
other of its kind, and only larger patches are unlike each other. So both pictures are compared at similar resolution,
and a match counts only when it is clearly the best (ratio test) in both directions.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from math import ceil

import cv2
import numpy as np

from restore.photo.reference import Reference
from restore.scan import Bytes, Floats, Ints

MAX_FEATURES = 8000
TILE = 1100  # pixels: SIFT keeps its pyramid of a picture in memory, 200 bytes and more a pixel
TILE_MARGIN = 64  # of a tile, that a feature near its edge has its surroundings
ROWS = 1024  # of features that are compared at once: 32 MB a product
CONTRAST = 0.02  # half of the usual: small print is faint at 55 pixels per inch
RATIO = 0.85  # of best to second best distance; robust estimation bears the wrong ones that it lets through


@dataclass(frozen=True, eq=False)
class Matches:
    """reference (n, 2) and photograph (n, 2): pixels that look alike, best first."""

    reference: Floats
    photograph: Floats


@dataclass(frozen=True, eq=False)
class Features:
    """places (n, 2) pixels and their descriptors (n, 128) float32."""

    places: Floats
    descriptors: np.ndarray


def reference_features(reference: Reference) -> Features:
    """The features on the page of a reference."""
    return detect(reference.grey, reference.page.astype(np.uint8))


def detect(grey: Bytes, mask: Bytes | None = None) -> Features:
    """The features of a picture (h, w) where mask (h, w) is not 0, found tile by tile."""
    tiles = list(_tiles(grey.shape))
    found = [_detect_in(grey, mask, rows, cols, MAX_FEATURES // len(tiles)) for rows, cols in tiles]
    return Features(np.concatenate([one.places for one in found]), np.concatenate([one.descriptors for one in found]))


def _tiles(shape: tuple[int, ...]) -> Iterator[tuple[slice, slice]]:
    """Rows and columns of the tiles of a picture (h, w)."""
    counts = [ceil(side / TILE) for side in shape]
    rows, cols = (
        [slice(side * k // count, side * (k + 1) // count) for k in range(count)]
        for side, count in zip(shape, counts, strict=True)
    )
    return product(rows, cols)


def _detect_in(grey: Bytes, mask: Bytes | None, rows: slice, cols: slice, most: int) -> Features:
    top, left = max(rows.start - TILE_MARGIN, 0), max(cols.start - TILE_MARGIN, 0)
    part = slice(top, rows.stop + TILE_MARGIN), slice(left, cols.stop + TILE_MARGIN)
    inside = np.zeros_like(grey[part])
    inside[rows.start - top : rows.stop - top, cols.start - left : cols.stop - left] = 1
    if mask is not None:
        inside &= mask[part] != 0
    sift = cv2.SIFT.create(nfeatures=most, contrastThreshold=CONTRAST)
    keypoints, descriptors = sift.detectAndCompute(grey[part], inside)
    if not keypoints:
        return Features(np.empty((0, 2)), np.empty((0, 128), np.float32))
    descriptors = np.sqrt(descriptors / np.maximum(descriptors.sum(axis=1, keepdims=True), 1e-6))
    return Features(np.array([k.pt for k in keypoints]) + [left, top], descriptors)


def match(reference: Features, photograph: Features) -> Matches:
    """The pairs of features that are clearly each other's best."""
    if min(len(reference.places), len(photograph.places)) < 2:
        return Matches(np.empty((0, 2)), np.empty((0, 2)))
    best, first, second, back = _nearest(reference.descriptors, photograph.descriptors)
    mutual = back[best] == np.arange(len(best))
    ratio = np.sqrt(np.maximum(2 - 2 * first, 0) / np.maximum(2 - 2 * second, 1e-9))
    kept = np.flatnonzero(mutual & (ratio < RATIO))
    kept = kept[np.argsort(ratio[kept])]
    return Matches(reference.places[kept], photograph.places[best[kept]])


def _nearest(ours: np.ndarray, theirs: np.ndarray) -> tuple[Ints, Floats, Floats, Ints]:
    """Match descriptors (n, 128) and (m, 128), unit vectors.

    The nearest has the largest product. Returns for each of ours the most similar of theirs, its product and the second
    best product, (n,) each, and for each of theirs the most similar of ours (m,).
    """
    best, first, second = np.empty(len(ours), int), np.empty(len(ours)), np.empty(len(ours))
    back, record = np.zeros(len(theirs), int), np.full(len(theirs), -np.inf)
    for start in range(0, len(ours), ROWS):
        products = ours[start : start + ROWS] @ theirs.T
        some, each = slice(start, start + len(products)), np.arange(len(products))
        top, columns = products.argmax(axis=0), np.arange(len(theirs))
        better = products[top, columns] > record
        back[better], record[better] = top[better] + start, products[top, columns][better]
        best[some] = products.argmax(axis=1)
        first[some] = products[each, best[some]]
        products[each, best[some]] = -np.inf
        second[some] = products.max(axis=1)
    return best, first, second, back
