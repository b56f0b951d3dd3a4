"""Estimate how far places on a page may be off.

Most of the error of a page repeats in every scan of the sheet. Nothing in one scan shows it, but what changes with the
method bounds it. How large it is on the whole page is known better than where it lies, so each
part counts half by what it is nearby and half by what it is on the page.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from math import sqrt
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from restore.prepared.prepared import Prepared, Unrolled
from restore.range_image.facets.sheet import PageOnGrid
from restore.scan import Floats, Mask
from restore.texture.page import MM_PER_INCH, page_map
from restore.uncertainty.displacements import Displacements, displacements

PITCH_MM = 5.0  # from place to place: the error changes over centimetres
NEARBY = 5  # places, the side of the square that is averaged
HALVINGS = 40  # of the interval in which the distance is sought that 95 % of the places do not exceed


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Hold standard deviations, mm, along either axis of the page; NaN off the page.

    noise    (h, w) of the scan's noise, one value for each PITCH_MM.
    method   (h, w) of what the method may be wrong by.
    sides    (2,) of width and height of the page.
    """

    noise: Floats
    method: Floats
    sides: Floats

    @property
    def total(self) -> Floats:
        """Return both together, (h, w) mm."""
        return np.hypot(self.noise, self.method)

    def on_page(self, page: Mask) -> NDArray[np.float32]:
        """Return the total (h, w) float32 mm on the pixels of a page (h, w), NaN off it."""
        total = self.total
        filled = np.where(np.isfinite(total), total, _nearest(total)).astype(np.float32)
        picture = cv2.resize(filled, page.shape[::-1], interpolation=cv2.INTER_LINEAR)
        return np.where(page, picture, np.float32(np.nan))

    def described(self) -> dict[str, float]:
        """Return values for the report: rms over the page, and what 95 % do not exceed, mm."""
        found = {name: _rms(getattr(self, name)) for name in ("noise", "method", "total")}
        return {**found, "p95": _distance_of_95(self.total[np.isfinite(self.total)])}


def estimate_uncertainty(prepared: Prepared, unrolled: Unrolled, scan: Any) -> Uncertainty | str:
    """Estimate the uncertainty of a flat page, or say why not.

    The noise is drawn with a seed from the points of the scan.
    """
    sheet = prepared.with_noise()
    if isinstance(sheet, str):
        return sheet
    page = PageOnGrid(unrolled.fine.flat, unrolled.fine.faces, unrolled.nodes)
    on_grid = page_map(page.flat, page.faces, page.nodes, MM_PER_INCH / PITCH_MM)
    known = np.isfinite(on_grid[..., 0])
    digest = hashlib.sha256(np.ascontiguousarray(scan.points).tobytes()).digest()
    rng = np.random.default_rng(int.from_bytes(digest[:8], "little"))
    moved = displacements(sheet, page, on_grid[known].astype(np.float64), rng)
    return combined(moved, known)


def combined(moved: Displacements, known: Mask) -> Uncertainty:
    """Combine the displacements of the places (h, w) that are known, in their order."""
    across = moved.noise.var(axis=0, ddof=1).mean(axis=1)
    noise = _nearby(_on_places(across, known), known)
    method = np.zeros(known.shape)
    for field, weight in method_fields(moved):
        squares = _on_places((field**2).mean(axis=1), known)
        method += weight * 0.5 * (_nearby(squares, known) + squares[known].mean())
    rows, cols = np.nonzero(known)
    places: Floats = PITCH_MM * np.stack([cols, rows], axis=1).astype(np.float64)
    own = np.var([_side_changes(field, places) for field in moved.noise], axis=0, ddof=1)
    other = np.sum([weight * _side_changes(field, places) ** 2 for field, weight in method_fields(moved)], axis=0)
    outside = np.where(known, 0.0, np.nan)
    return Uncertainty(np.sqrt(noise) + outside, np.sqrt(method) + outside, np.sqrt(own + other))


def method_fields(moved: Displacements) -> list[tuple[Floats, float]]:
    """Return fields (n, 2) mm of the method's errors, and the weight of their squares."""
    return [
        *((field, 1.0 / len(moved.lattices)) for field in moved.lattices),
        (moved.window, 1.0),
        (moved.creases, 1.0),
    ]


def _side_changes(field: Floats, places: Floats) -> Floats:
    """Return by what a field (n, 2) mm lengthens width and height, (2,) mm."""
    arms = places - places.mean(axis=0)
    return np.asarray((arms * field * [1.0, -1.0]).sum(axis=0) / (arms**2).sum(axis=0) * np.ptp(places, axis=0))


def _on_places(values: Floats, known: Mask) -> Floats:
    """Put values (n,) on the places (h, w) that are known; 0 elsewhere."""
    grid = np.zeros(known.shape)
    grid[known] = values
    return grid


def _nearby(values: Floats, known: Mask) -> Floats:
    """Average values (h, w) over the known places of a square round each."""
    size = (NEARBY, NEARBY)
    total, count = (
        cv2.boxFilter(grid, cv2.CV_64F, size, normalize=False, borderType=cv2.BORDER_CONSTANT)
        for grid in (np.where(known, values, 0.0), known.astype(np.float64))
    )
    return np.asarray(total / np.maximum(count, 1.0))


def _nearest(values: Floats) -> Floats:
    """Fill values (h, w) from the nearest places that have one."""
    from scipy.ndimage import distance_transform_edt

    rows, cols = distance_transform_edt(np.isnan(values), return_distances=False, return_indices=True)
    return np.asarray(values[rows, cols])


def _rms(values: Floats) -> float:
    return sqrt(float(np.nanmean(values**2)))


def _distance_of_95(sigma: Floats) -> float:
    """Return the distance, mm, that 95 % of places are off at most, by sigma (n,) mm."""
    low, high = 0.0, 5.0 * float(sigma.max())
    squares = 2.0 * np.maximum(sigma, np.finfo(float).tiny ** 0.25) ** 2
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        beyond = float(np.exp(-(middle**2) / squares).mean())
        low, high = (middle, high) if beyond > 0.05 else (low, middle)
    return high
