"""Evenness of the light on a chart: what its patches reflect against what they should.

A lamp's fall-off changes smoothly over a chart, and the colours of neighbouring patches have nothing in common: a
quadratic of the place on the chart that explains more of the errors in luminance than chance does is light.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from restore.scan import Floats

COLUMNS, ROWS = 6, 4
MIN_RANGE = 0.05  # of the light: below it, half a unit of L*, fit and lamp cannot be separated
CHANCE = 0.001  # of an even light that is mistaken for an uneven one
FLARE = 0.05  # of white: stray light and noise hide what darker patches say


@dataclass(frozen=True, eq=False)
class Evenness:
    """Evenness of the light on the patches.

    light: (24,), 1 at most.
    fall_off: the fraction of it that is lost at the darkest, 0 for even light.
    """

    light: Floats
    fall_off: float


EVEN = Evenness(np.ones(COLUMNS * ROWS), 0.0)


def measure_evenness(seen: Floats, wanted: Floats) -> Evenness:
    """Measure the light on the patches from their luminance.

    EVEN when a quadratic of the place explains no more than chance does (F test).
    seen, wanted: (24,), measured luminance and that of the chart, white being 1.
    """
    terms = _terms()
    weight = np.sqrt(wanted / (wanted + FLARE))
    ratio = np.log(np.maximum(seen, FLARE / 10) / np.maximum(wanted, FLARE / 10))
    even = ratio - np.average(ratio, weights=weight**2)
    fit = np.linalg.lstsq(terms * weight[:, None], ratio * weight, rcond=None)[0]
    left, before = (float(((error * weight) ** 2).sum()) for error in (ratio - terms @ fit, even))
    free, rest = terms.shape[1] - 1, len(ratio) - terms.shape[1]
    improvement = (before - left) / free / max(left / rest, np.finfo(float).tiny)
    light = np.exp(terms @ fit)
    light /= light.max()
    fall_off = float(1.0 - light.min())
    if fall_off < MIN_RANGE or fdtrc(free, rest, improvement) > CHANCE:
        return EVEN
    return Evenness(light, fall_off)


def _terms() -> Floats:
    """Return the terms (24, 6) of the patches, row by row: 1, place and its squares."""
    y, x = np.meshgrid(np.linspace(-1, 1, ROWS), np.linspace(-1, 1, COLUMNS), indexing="ij")
    return np.stack([np.ones_like(x), x, y, x * y, x * x, y * y], axis=-1).reshape(-1, 6)
