"""Similarity of the print of two pages.

A page that was captured twice is noticed before the next one.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import cv2
import numpy as np

from restore.scan import Bytes, Floats
from station.verdict.packed import pack, unpack

SIDE = 192  # pixels of a fingerprint's side: a word still differs from another one
BLOCKS = 4  # along each side; each is found by itself, as two restorations of a page differ by a millimetre
REACH = 8  # pixels by which a block may have moved: four hundredths of the page
SMOOTH = SIDE / 10  # pixels: what is wider is light and margins, alike on every page
SHARP = 0.9  # pixels: what is narrower depends on where the pixels of a shot fall
NOISE_LEVELS = 6.0  # of a fingerprint's pixel, a mean of dozens: below it the page is blank
BITS, STEPS = 4, 2.5  # of a stored pixel; steps to a standard deviation of the print
ZERO = 2 ** (BITS - 1)
KEPT = 256  # fingerprints that stay unpacked: each page is compared with those before it


def fingerprint(image: Bytes) -> str:
    """Return the print of a page (h, w, 3) uint8, as base64.

    SIDE × SIDE; `similarity` compares two of them.
    """
    grey = cv2.resize(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), (SIDE, SIDE), interpolation=cv2.INTER_AREA)
    details = grey.astype(np.float32)
    details -= cv2.GaussianBlur(details, (0, 0), SMOOTH)
    scale = STEPS / details.std() if np.abs(details).max() > NOISE_LEVELS else 0.0
    steps = np.clip(np.round(details * scale) + ZERO, 0, 2**BITS - 1).astype(np.uint8)
    return pack((steps[:, ::2] << BITS | steps[:, 1::2]).tobytes())


def similarity(one: str, other: str) -> float:
    """Return the similarity of two pages, −1 to 1.

    Median over the printed blocks of one page of their greatest correlation with the other near by. 0 for a blank page,
    which is like no other.
    """
    correlations = list(_correlations(_unpacked(one), _unpacked(other)))
    return float(np.median(correlations)) if correlations else 0.0


def _correlations(first: Floats, second: Floats) -> Iterator[float]:
    size, around = SIDE // BLOCKS, np.pad(second, REACH, mode="edge")
    for y in range(0, SIDE, size):
        for x in range(0, SIDE, size):
            block = np.ascontiguousarray(first[y : y + size, x : x + size])
            place = np.ascontiguousarray(around[y : y + size + 2 * REACH, x : x + size + 2 * REACH])
            if block.std() > 0.5 and place.std() > 0.5:  # half a step: a block without print says nothing
                yield float(cv2.matchTemplate(place, block, cv2.TM_CCOEFF_NORMED).max())


@lru_cache(KEPT)
def _unpacked(fingerprint: str) -> Floats:
    """Return a fingerprint as (SIDE, SIDE) float32.

    Means of rows and columns are removed: lines and margins are alike on every page.
    """
    packed = np.frombuffer(unpack(fingerprint), np.uint8).reshape(SIDE, SIDE // 2)
    steps = np.stack([packed >> BITS, packed & (2**BITS - 1)], axis=2).reshape(SIDE, SIDE).astype(np.float32) - ZERO
    steps = cv2.GaussianBlur(steps, (0, 0), SHARP)
    details: Floats = steps - steps.mean(axis=0) - steps.mean(axis=1)[:, None]
    details.flags.writeable = False
    return details
