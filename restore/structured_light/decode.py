"""Decodes the patterns that each pixel of the camera sees.

They give the projector's pixel, and where its edges cross the picture. Neighbouring columns of the projector differ in
one bit of their Gray code. Where two neighbouring pixels of the camera see neighbouring columns, the edge between these
crosses at the zero of pattern minus inverse of that bit: known to a fraction of a pixel, whatever is printed there
(Trobina, "Error model of a coded-light range sensor", ETH Zürich BIWI-TR-164, 1995). A pixel that mixes the light of
two places, as at the rim of a shadow, has more than one faint bit, and no code (cf. Xu & Aliaga, "Robust pixel
classification for 3D modeling with structured light", GI 2007).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from restore.numerics.robust import OUTLYING, robust_sigma
from restore.scan import Bytes, Mask

Codes = NDArray[np.int32]
Crossings = NDArray[np.float32]

# The mask [[1, −2, 1], [−2, 4, −2], [1, −2, 1]] gives noise six times its standard deviation, and nothing on planes
# (Immerkær, "Fast noise variance estimation", CVIU 1996).
NOISE_MASK = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
NOISE_GAIN = 6.0
# A pixel that the projector does not light differs between white and black by √2 σ of noise: what lies beyond
# four times that is noise once in 30,000.
LIT_SIGMAS = OUTLYING * 2**0.5
FAINT = 0.5  # of the contrast between white and black: a bit has that much half a blur from its edge
REACH = 2  # pixels: three standard deviations of the blur of a camera in focus
STEP = 0.5  # of the grey levels, a fifth of the light
HALF_LIGHT = 0.735  # grey levels (sRGB) at half the light: on the edge between bright and dark
MIN_NOISE = 0.3  # grey levels: rounding to whole ones has 1/√12


@dataclass(frozen=True, eq=False)
class Axis:
    """Columns of the projector as the camera sees them, or its rows.

    code: (h, w), of each pixel, −1 where it has none.
    across: (h, w − 1), fraction of the way from a pixel to its right neighbour at which the edge between their codes
        crosses, NaN where their codes are not neighbours.
    down: (h − 1, w), the same to the lower neighbour.
    """

    code: Codes
    across: Crossings
    down: Crossings


@dataclass(frozen=True, eq=False)
class Light:
    """How the projector lights a picture.

    level: (h, w), grey levels where they give codes: beyond the noise, and not next to a step of the light, as at the
        rim of a shadow, of black ink or of the page, where the blur mixes both sides and shifts the edges of the
        patterns. 0 elsewhere.
    lit: (h, w), True there, and on the brighter side of a step between lit surfaces, as from the page to the table.
    """

    level: NDArray[np.float32]
    lit: Mask


def projected_light(white: Bytes, black: Bytes) -> Light:
    """Return the light of the projector in a picture.

    white, black: (h, w), pictures of the white and of the black pattern.
    """
    noise = robust_sigma(cv2.filter2D(black.astype(np.float32), -1, NOISE_MASK)) / NOISE_GAIN
    level = white.astype(np.float32) - black
    round_it = np.ones((2 * REACH + 1, 2 * REACH + 1), np.uint8)
    darkest, brightest = cv2.erode(level, round_it), cv2.dilate(level, round_it)
    least = LIT_SIGMAS * max(noise, MIN_NOISE)
    even = (level > least) & (darkest > STEP * brightest)
    brighter = (darkest > least) & (level > HALF_LIGHT * brightest)
    return Light(np.where(even, level, np.float32(0)), np.asarray(even | brighter))


def decode_axis(pairs: Iterable[tuple[Bytes, Bytes]], light: NDArray[np.float32], size: int) -> Axis:
    """Decode the axis that pairs of a pattern and its inverse encode.

    Most significant bit first; the patterns are (h, w).
    light: (h, w), of the projector.
    size: of its picture along the axis, in pixels; codes beyond are invalid.
    """
    code = np.zeros(light.shape, np.int32)
    bit = np.zeros(light.shape, bool)
    faint = np.zeros(light.shape, np.uint8)
    crossings = [np.zeros(_both(code, axis)[0].shape, np.float32) for axis in (1, 0)]
    for pattern, inverse in pairs:
        difference = pattern.astype(np.float32) - inverse
        bright = difference > 0
        bit ^= bright  # Gray to binary: every bit is the parity of those before it
        code = 2 * code + bit
        faint += np.abs(difference) < FAINT * light
        for crossing, axis in zip(crossings, (1, 0), strict=True):
            here, there = _both(difference, axis)
            changed = (here > 0) != (there > 0)
            crossing[changed] = here[changed] / (here - there)[changed]
    known = (light > 0) & (code < size) & (faint <= 1)
    for crossing, axis in zip(crossings, (1, 0), strict=True):
        here, there = _both(code, axis)
        crossing[~_joined(known, axis) | (np.abs(here - there) != 1)] = np.nan
    code[~known] = -1
    return Axis(code, *crossings)


def _both(values: NDArray[Any], axis: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return each pixel's value and its right (axis 1) or lower (axis 0) neighbour's."""
    return (values[:, :-1], values[:, 1:]) if axis == 1 else (values[:-1], values[1:])


def _joined(mask: Mask, axis: int) -> Mask:
    here, there = _both(mask, axis)
    return np.asarray(here & there)
