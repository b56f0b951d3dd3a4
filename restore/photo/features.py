"""Points that reference and photograph have in common: SIFT features (Lowe 2004), compared as RootSIFT (Arandjelović &
Zisserman 2012).

Print repeats itself: a letter looks like every other of its kind, and only larger patches are unlike each other. So
both pictures are compared at like resolution, and a match counts only when it is clearly the best (ratio test) both
ways.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from restore.photo.reference import Reference
from restore.scan import Bytes, Floats

MAX_FEATURES = 8000
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
    """The features of a picture (h, w) where mask (h, w) is not 0."""
    sift = cv2.SIFT.create(nfeatures=MAX_FEATURES, contrastThreshold=CONTRAST)
    keypoints, descriptors = sift.detectAndCompute(grey, mask)
    if not keypoints:
        return Features(np.empty((0, 2)), np.empty((0, 128), np.float32))
    descriptors = np.sqrt(descriptors / np.maximum(descriptors.sum(axis=1, keepdims=True), 1e-6))
    return Features(np.array([k.pt for k in keypoints]), descriptors)


def match(reference: Features, photograph: Features) -> Matches:
    """The pairs of features that are clearly each other's best."""
    if min(len(reference.places), len(photograph.places)) < 2:
        return Matches(np.empty((0, 2)), np.empty((0, 2)))
    # The descriptors are unit vectors: the nearest has the largest product.
    products = reference.descriptors @ photograph.descriptors.T
    best = products.argmax(axis=1)
    mutual = products.argmax(axis=0)[best] == np.arange(len(best))
    second = np.partition(products, -2, axis=1)[:, -2]
    first = products[np.arange(len(best)), best]
    ratio = np.sqrt(np.maximum(2 - 2 * first, 0) / np.maximum(2 - 2 * second, 1e-9))
    kept = np.flatnonzero(mutual & (ratio < RATIO))
    kept = kept[np.argsort(ratio[kept])]
    return Matches(reference.places[kept], photograph.places[best[kept]])
