"""Regions of constant print, and the brightness within them.

Within a patch of one ink, or of bare paper, every change of brightness is the light's, whatever the patch reflects: an
edge of print bounds the patch, and its albedo is one unknown (Land & McCann, "Lightness and Retinex theory", J. Opt.
Soc. Am. 61(1), 1971). Smooth gradients inside a picture cannot be distinguished from light this way: they are scatter
that no light explains, and so they count against every one.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from restore.numerics.limits import SINGLE_TINY
from restore.scan import Floats, Ints, Mask
from restore.shading.paper import HUE
from restore.shading.relief import Field

WINDOW = 3  # cells: over less noise makes edges, over more the gaps between lines of print are lost
EDGE = 0.12  # of the brightness, over two windows: a shaded curl of 60° over 20 mm changes by less
CREASE_EDGE = 0.7  # of its logarithm: light halves across a sharp fold, ink takes more
CHROMA_EDGE = 0.01  # of a channel's fraction of the colour, over two windows: a tint of ΔE 3 shows as much, lamps less
NOISE_RANGE = 4.0  # standard deviations between the least and the greatest of nine windows
SHARP = 0.02  # of the normal, from window to window: a crease, where light may change as abruptly as print
MIN_FRACTION = 0.003  # of the page: 190 mm² of A4; smaller patches hold no gradient
MAX_REGIONS = 24


@dataclass(frozen=True, eq=False)
class Regions:
    """Regions of constant print.

    labels: (r, c), 1 to count from the largest to the smallest region, 0 outside.
    """

    labels: Ints
    count: int

    @property
    def largest(self) -> Mask:
        """Return where the largest region is, (r, c)."""
        return np.asarray(self.labels == 1)

    def fraction(self, inside: Mask) -> float:
        """Return the fraction of the page (r, c) that lies in any region."""
        return float((self.labels > 0).sum() / max(int(inside.sum()), 1))


def regions_of(colour: Field, normals: Field, inside: Mask, crease_edge: float = CREASE_EDGE) -> Regions:
    """Return the regions of constant print of a page.

    colour: (r, c, 3), linear.
    normals: (r, c, 3).
    crease_edge: of the logarithm of the brightness, what counts as print along creases.
    """
    patches = patches_of(colour, normals, inside, EDGE, crease_edge)
    areas = np.bincount(patches.ravel())
    areas[_hue_spread(colour, patches, areas) > HUE] = 0
    areas[0] = 0
    order = np.argsort(-areas, kind="stable")[:MAX_REGIONS]
    order = order[areas[order] >= max(MIN_FRACTION * inside.sum(), 1)]
    renamed = np.zeros(len(areas), np.int64)
    renamed[order] = np.arange(1, len(order) + 1)
    return Regions(renamed[patches], len(order))


def _hue_spread(colour: Field, patches: Ints, areas: Ints) -> Floats:
    """Return the spread (n,) of the hue over every patch.

    Standard deviation of a channel's fraction of the colour, the greater of red and blue.
    """
    total = np.maximum(cv2.blur(cv2.transform(colour, np.ones((1, 3))), (WINDOW, WINDOW)), SINGLE_TINY)
    spreads = []
    for k in (0, 2):
        fraction = (cv2.blur(colour[..., k], (WINDOW, WINDOW)) / total).ravel()
        mean, square = (
            np.bincount(patches.ravel(), part) / np.maximum(areas, 1) for part in (fraction, fraction * fraction)
        )
        spreads.append(np.sqrt(np.maximum(square - mean * mean, 0)))
    return np.asarray(np.maximum(*spreads))


def patches_of(colour: Field, normals: Field, inside: Mask, edge: float, crease_edge: float) -> Ints:
    """Return the numbers (r, c) int32 of connected patches of print.

    Without an edge of print; 0 on edges.
    edge, crease_edge: of the logarithm of the brightness, over two windows, on the smooth page and along creases; noise
        is allowed for.
    """
    total = np.maximum(cv2.transform(colour, np.ones((1, 3))), SINGLE_TINY)
    mean = cv2.blur(total, (WINDOW, WINDOW))
    relative = relative_noise(total, mean, inside)
    allowed = np.where(_creased(normals), np.float32(crease_edge), np.float32(edge))
    print_edge = _log_range(mean) > allowed + NOISE_RANGE * relative
    for k in (0, 2):
        fraction = cv2.blur(colour[..., k], (WINDOW, WINDOW)) / mean
        print_edge |= _range(fraction) > CHROMA_EDGE + NOISE_RANGE * relative / 3
    # A cell's window and the neighbours of it: what lies off the page has no say.
    within = cv2.erode(inside.astype(np.uint8), np.ones((2 * WINDOW - 1, 2 * WINDOW - 1), np.uint8))
    plain = cv2.bitwise_and(within, (~print_edge).astype(np.uint8))
    return np.asarray(cv2.connectedComponents(plain, connectivity=4)[1])


def relative_noise(total: Field, mean: Field, inside: Mask) -> Field:
    """Return the relative noise (r, c) of a window's mean brightness: its standard deviation.

    total, mean: (r, c), three channels.
    """
    # A code of a display is about the root 2.2 of the light.
    return np.asarray(2.2 * _noise(total, inside) / (mean / 3) ** (1 / 2.2) / WINDOW)


def _noise(total: Field, inside: Mask) -> float:
    """Return the standard deviation of a cell's brightness, in codes 0 to 1, where plain.

    J. Immerkær, "Fast noise variance estimation", Computer Vision and Image Understanding 64(2), 1996: a kernel that
    gives nothing on planes.
    """
    code = (total / 3) ** np.float32(1 / 2.2)
    kernel = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
    curved = np.abs(cv2.filter2D(code, cv2.CV_32F, kernel))[cv2.erode(inside.astype(np.uint8), np.ones((3, 3))) > 0]
    if not len(curved):
        return 0.0
    # The lower quartile of |x| of a normal distribution is 0.319 σ; the kernel's gain is 6.
    return float(np.percentile(curved[::7], 25) / 0.319 / 6)


def _range(field: Field) -> Field:
    kernel = np.ones((WINDOW, WINDOW), np.uint8)
    return np.asarray(cv2.dilate(field, kernel) - cv2.erode(field, kernel))


def _log_range(field: Field) -> Field:
    return _range(np.log(field))


def _creased(normals: Field) -> Mask:
    """Return where the normals change as across a crease, (r, c), from window to window."""
    known = np.nan_to_num(normals)
    change = np.max([_range(cv2.blur(known[..., k], (WINDOW, WINDOW))) for k in range(3)], axis=0)
    return np.asarray(change > SHARP * WINDOW)


def unexplained(brightness: Floats, light: Floats, labels: Ints, cap: float) -> Floats:
    """Return squared deviations (n,) of log light, less each region's median, up to cap².

    brightness, light: (n,), positive.
    labels: (n,), regions.
    """
    rest = np.log(np.maximum(brightness, SINGLE_TINY)) - np.log(np.maximum(light, SINGLE_TINY))
    for label in np.unique(labels):
        here = labels == label
        rest[here] -= np.median(rest[here])
    return np.asarray(np.minimum(rest**2, cap**2))
