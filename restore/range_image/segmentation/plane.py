"""Plane of a table, or nearly one, along the border of a range image."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from restore.numerics.robust import OUTLYING, robust_sigma
from restore.range_image.segmentation.surface import BORDER_BAND, block_numbers, blocks_of, likeliest_surface, terms_of
from restore.scan import Floats, Mask, RangeScan
from restore.vivid import WRITTEN_MM

MAX_BOW = 0.01  # of the breadth of the picture: what a table may be bowed by; a page is bent by more
EVERYWHERE = 64  # samples between those that determine how far a surface is bowed


class TablePlane(NamedTuple):
    """A plane below a range image, or one that is bowed a little.

    height     (rows, cols) mm of the samples above it, NaN for none.
    tolerance  mm: noise explains as much of it, and how uneven the plane is.
    pitch      mm from a sample to the next.
    """

    height: Floats
    tolerance: float
    pitch: float

    @property
    def measured(self) -> Mask:
        """Return where a sample was measured, (rows, cols) bool."""
        return np.isfinite(self.height)

    @property
    def samples(self) -> Mask:
        """Return the samples on the plane, (rows, cols) bool."""
        return np.asarray(np.abs(self.height) < self.tolerance)


def lies_on(plane: TablePlane, samples: Mask) -> bool:
    """Whether most of samples (rows, cols) lie on a plane."""
    return bool(samples.any() and plane.samples[samples].mean() > 0.5)


def fit_table_plane(scan: RangeScan, inverse_depth: Floats, band: Mask, apart: int) -> tuple[TablePlane, Mask]:
    """Fit the likeliest plane of a band (rows, cols).

    inverse_depth: (rows, cols) 1/mm; for a plane it is an affine function of the direction of a sample, and for one
        that is bowed a little a quadratic.
    apart: distance in samples from which on noise is independent.
    Returns the plane, and (rows, cols) bool of the samples that determine it.
    """
    x, y = (scan.points[..., axis] * inverse_depth for axis in (0, 1))
    pitch = _pitch(x)  # in samples: with lens distortion row and column are not affine in them
    to_mm = float(np.median(1.0 / inverse_depth[band])) ** 2
    nearer, terms = inverse_depth * to_mm, terms_of(x / pitch, y / pitch)
    noise = _noise_sigma(inverse_depth, band, apart) * to_mm
    numbers = block_numbers(band)
    blocks = blocks_of(numbers, terms[band], nearer[band], noise, apart)
    everywhere = np.flatnonzero(np.isfinite(nearer))[::EVERYWHERE]
    own = np.zeros_like(band)
    side = abs(pitch) * float(np.sqrt(to_mm))
    most = MAX_BOW * side * max(band.shape)
    surface = likeliest_surface(blocks, terms.reshape(-1, terms.shape[-1])[everywhere], most)
    if surface is None:
        return TablePlane(nearer, OUTLYING * noise, side), own  # over a plane at infinity: nothing lies on it
    own[band] = surface.of(blocks)[numbers]
    tolerance = OUTLYING * float(np.hypot(noise, surface.uneven))
    return TablePlane(nearer - terms @ surface.factors, tolerance, side), own


def refitted(plane: TablePlane, samples: Mask) -> TablePlane:
    """Fit a surface bowed a little to the samples (rows, cols) of a table.

    Returns the plane itself where they do not determine another, or are bowed too much for a table.
    """
    row, col = (part[::EVERYWHERE] for part in np.nonzero(samples))
    rows, cols = plane.height.shape
    x, y = np.linspace(-1.0, 1.0, cols), np.linspace(-1.0, 1.0, rows)
    terms = terms_of(x[col], y[row])
    factors, _, rank, _ = np.linalg.lstsq(terms, plane.height[row, col], rcond=None)
    change = terms_of(*np.meshgrid(x, y)) @ factors
    if rank < terms.shape[1] or np.ptp(change) > MAX_BOW * plane.pitch * max(rows, cols):
        return plane
    return plane._replace(height=plane.height - change)


def _pitch(x: Floats) -> float:
    """Return the median change from a column to the next.

    x: (rows, cols), NaN where missing; columns as near as exist are used.
    """
    changes = ((x[:, apart:] - x[:, :-apart]) / apart for apart in range(1, x.shape[1]))
    return float(next((np.nanmedian(one) for one in changes if np.isfinite(one).any()), 1.0))


def _noise_sigma(inverse_depth: Floats, band: Mask, apart: int) -> float:
    """Return the standard deviation of a sample, 1/mm.

    Over two widths of the band a page is nearly straight: from its deviation from the line between the samples before
    and after it. They are in one column, where noise is uncorrelated, and count alike where most were lost.
    """
    every = np.ascontiguousarray(band[::apart].T)
    col, row = np.nonzero(every)
    value = inverse_depth[::apart].T[every]
    span = row[2:] - row[:-2]
    together = (col[2:] == col[:-2]) & (span <= 2 * BORDER_BAND)
    fraction = ((row[1:-1] - row[:-2]) / np.maximum(span, 1))[together]
    before, own, after = (part[together] for part in (value[:-2], value[1:-1], value[2:]))
    off = (own - (1.0 - fraction) * before - fraction * after) / np.sqrt(1.0 + fraction**2 + (1.0 - fraction) ** 2)
    floor = WRITTEN_MM * float(np.nanmedian(inverse_depth)) ** 2
    return max(robust_sigma(off), floor) if off.size else floor
