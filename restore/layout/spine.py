"""Finds the spine of an opened book on its flat page.

It is the valley in which the surface turns most. Both walls of a gutter face each other, so the surface normals left
and right of the spine differ most, and towards the reader. A page then arches back and flattens out; the panels of a
folded letter do not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from restore.numerics.lines import theil_sen
from restore.numerics.robust import robust_sigma
from restore.scan import Floats

PER_MM = 2.0  # columns of the tilt map for one millimetre: half a sample of the scanner's fine mode
BANDS = 12  # across the height; each shows the spine for itself
WINDOW_MM = 8.0  # left and right of a place, over which the tilt is averaged, and in which a band has its valley
NARROW_MM = 3.0  # for the exact place, and of a window that the page's edge cuts: a steep wall turns within so little
BEYOND_MM = (10.0, 25.0)  # from the spine: where a page arches back; a valley or a ridge beyond is another crease


@dataclass(frozen=True)
class Spine:
    """The deepest valley of a flat page, and how much it is like a spine.

    place       (n, 2) mm on the flat page from its upper left corner, x right, y down, from head to tail.
    sigma_mm    standard deviation of its place.
    turn_deg    turn of the surface across it, negative for a valley.
    beyond_deg  turn of the surface next to it, positive where the pages arch back.
    other_deg   greatest turn elsewhere, of a valley or a ridge, in the median of the bands.
    bands       fraction of the height in which it is found.
    lean_deg    from the direction of the page's sides.
    """

    place: Floats
    sigma_mm: float
    turn_deg: float
    beyond_deg: float
    other_deg: float
    bands: float
    lean_deg: float


def tilt_map(normals: NDArray[np.float32], up: Floats) -> Floats:
    """Return how far unit normals lean to the right about the page's upward direction.

    normals: (h, w, 3), NaN off the page. up: (3,). Returns (h, w) rad.
    """
    up = up / np.linalg.norm(up)
    front = np.nanmean(normals, axis=(0, 1)).astype(float)
    front -= (front @ up) * up
    front /= np.linalg.norm(front)
    right = np.cross(up, front)
    return np.asarray(np.arctan2(normals @ right, normals @ front), float)


def find_spine(tilt: Floats) -> Spine | None:
    """Return the deepest valley of a tilt map (h, w) of PER_MM pixels per mm, or None."""
    profile = _band_means(tilt)
    turns = turns_of(profile, WINDOW_MM)
    whole = _median(turns)
    if not np.isfinite(whole).any():
        return None
    middle = int(np.nanargmin(whole))
    depth = float(whole[middle])
    places, depths = _place_in_bands(profile, turns, middle)
    height = tilt.shape[0]
    rows = (np.arange(BANDS) + 0.5) * height / BANDS
    shown = np.isfinite(places) & (depths < 0)
    if depth >= 0 or shown.sum() < 3:
        return None
    slope, offset = theil_sen(rows[shown], places[shown])
    residual = places[shown] - slope * rows[shown] - offset
    sigma = robust_sigma(residual) / np.sqrt(shown.sum()) / PER_MM
    ends = np.array([0.0, height / 2, height])
    line = np.column_stack([slope * ends + offset, ends]) / PER_MM
    near, far = BEYOND_MM
    away = np.abs(np.arange(len(whole)) - middle) / PER_MM
    return Spine(
        line,
        float(sigma),
        float(np.degrees(depth)),
        float(np.degrees(_mean(whole[(away >= near) & (away <= far)]))),
        float(np.degrees(np.median([_greatest(band[away > far]) for band in turns]))),
        float(shown.mean()),
        float(np.degrees(np.arctan(slope))),
    )


def turns_of(profile: Floats, window_mm: float) -> Floats:
    """Return the turns (bands, w) rad of a profile at each left border.

    Its mean right of the left border of each column less that left of it; NaN near the edges of the page.
    profile: (bands, w).
    """
    known = np.isfinite(profile)
    width = profile.shape[1]
    total, count = (
        np.pad(np.cumsum(values, axis=1), ((0, 0), (1, 0))) for values in (np.where(known, profile, 0.0), known)
    )
    at = np.arange(width)
    window = round(window_mm * PER_MM)

    def mean(first: NDArray[np.int64], end: NDArray[np.int64]) -> Floats:
        first, end = np.clip(first, 0, width), np.clip(end, 0, width)
        number = (count[:, end] - count[:, first]).astype(float)
        number[number < NARROW_MM * PER_MM] = np.nan
        return np.asarray((total[:, end] - total[:, first]) / number)

    return mean(at, at + window) - mean(at - window, at)


def _place_in_bands(profile: Floats, turns: Floats, middle: int) -> tuple[Floats, Floats]:
    """Return place and depth of the valley in each band, (bands,) each.

    The place is the border between columns near `middle`, NaN without a valley; the depth is in rad.
    """
    reach = round(WINDOW_MM * PER_MM)
    first = max(middle - reach, 0)
    near = slice(first, middle + reach + 1)
    narrow = turns_of(profile, NARROW_MM)[:, near]
    known = np.isfinite(narrow).any(axis=1)
    at = np.argmin(np.where(np.isfinite(narrow), narrow, np.inf), axis=1)
    inner = np.clip(at, 1, narrow.shape[1] - 2)
    before, here, after = (narrow[np.arange(BANDS), inner + k] for k in (-1, 0, 1))
    with np.errstate(invalid="ignore", divide="ignore"):
        vertex = np.clip(0.5 * (before - after) / (before - 2 * here + after), -1.0, 1.0)
    places = np.where(known & (at == inner), first + inner + np.nan_to_num(vertex), np.nan)
    depths = np.min(np.where(np.isfinite(turns[:, near]), turns[:, near], np.inf), axis=1)
    return places, depths


def _band_means(tilt: Floats) -> Floats:
    """Return the mean of each column in each band of rows, (BANDS, w) rad, NaN off the page.

    tilt: (h, w).
    """
    bands = []
    for band in np.array_split(tilt, BANDS):
        known = np.isfinite(band)
        count = known.sum(axis=0)
        mean = np.where(known, band, 0.0).sum(axis=0) / np.maximum(count, 1)
        bands.append(np.where(2 * count > len(band), mean, np.nan))
    return np.stack(bands)


def _median(turns: Floats) -> Floats:
    """Return the median (w,) over the bands, NaN where fewer than half of them are known."""
    known = 2 * np.isfinite(turns).sum(axis=0) > len(turns)
    median = np.full(turns.shape[1], np.nan)
    median[known] = np.nanmedian(turns[:, known], axis=0)
    return median


def _mean(values: Floats) -> float:
    return float(np.nanmean(values)) if np.isfinite(values).any() else 0.0


def _greatest(values: Floats) -> float:
    return float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))
