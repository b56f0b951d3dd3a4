"""The plane of a table, fitted to what was measured along the border of a range image."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from restore.robust import robust_sigma
from restore.scan import Floats, Mask, RangeScan

RANSAC_TRIALS = 200  # of three samples: with a quarter on the plane, one trial in 64 hits it
TRIAL_SUBSET = 2000  # samples on which the inliers of a trial are counted
ON_PLANE_SIGMAS = 4.0
MIN_NOISE_MM = 0.01  # coordinates are written to a hundredth of a millimetre
REFINEMENTS = 3
MAX_SPAN = 24  # samples over which a page is nearly straight, and lines within one side of the band
LEAST_SPANS = 30  # that tell noise, to a sixth of it


class TablePlane(NamedTuple):
    """A plane below a range image.

    height     (rows, cols) mm of the samples above it, NaN for none.
    tolerance  mm: noise explains as much of it.
    pitch      mm from a sample to the next.
    """

    height: Floats
    tolerance: float
    pitch: float

    @property
    def measured(self) -> Mask:
        """(rows, cols) True where there is a sample."""
        return np.isfinite(self.height)

    @property
    def samples(self) -> Mask:
        """(rows, cols) True on the plane."""
        return np.asarray(np.abs(self.height) < self.tolerance)


def lies_on(plane: TablePlane, samples: Mask) -> bool:
    """Whether most of samples (rows, cols) lie on a plane."""
    return bool(samples.any() and plane.samples[samples].mean() > 0.5)


def fit_table_plane(scan: RangeScan, inverse_depth: Floats, band: Mask, apart: int) -> TablePlane:
    """The plane of most samples of a band (rows, cols).

    inverse_depth (rows, cols) 1/mm: for a plane it is an affine function of the direction of a sample. apart: so many
    samples lie between two that have noise of their own.
    """
    x, y = (scan.points[..., axis] * inverse_depth for axis in (0, 1))
    pitch = _pitch(x)  # in samples: with lens distortion row and column are not affine in them
    values, design = inverse_depth[band], np.column_stack([np.ones(band.sum()), x[band] / pitch, y[band] / pitch])
    noise = _noise_sigma(inverse_depth, band, apart)
    offset, right, up = _most_on(design, values, ON_PLANE_SIGMAS * noise)
    to_mm = float(np.median(1.0 / values)) ** 2
    nearer = inverse_depth - offset - x * (right / pitch) - y * (up / pitch)
    return TablePlane(nearer * to_mm, ON_PLANE_SIGMAS * noise * to_mm, abs(pitch) * float(np.sqrt(to_mm)))


def _most_on(design: Floats, values: Floats, tolerance: float) -> Floats:
    """(3,) the plane, design (n, 3) · plane = values (n,) within a tolerance, on which most of them are (RANSAC)."""
    random = np.random.default_rng(0)  # fixed: the same scan gives the same page
    subset = random.choice(len(values), min(TRIAL_SUBSET, len(values)), replace=False)
    triples = random.integers(len(values), size=(RANSAC_TRIALS, 3))
    triples = triples[np.abs(np.linalg.det(design[triples])) >= 1.0]  # not on a line
    if not len(triples):
        return np.zeros(3)
    planes = np.linalg.solve(design[triples], values[triples][..., None])[..., 0]
    off = np.abs(design[subset] @ planes.T - values[subset, None])
    best = planes[(off < tolerance).sum(axis=0).argmax()]
    for _ in range(REFINEMENTS):
        inliers = np.abs(design @ best - values) < tolerance
        if inliers.sum() < 3:
            break
        best = np.asarray(np.linalg.lstsq(design[inliers], values[inliers], rcond=None)[0], float)
    return best


def _pitch(x: Floats) -> float:
    """The median change from a column to the next of values (rows, cols), NaN for none, by columns as near as exist."""
    changes = ((x[:, apart:] - x[:, :-apart]) / apart for apart in range(1, x.shape[1]))
    return float(next((np.nanmedian(one) for one in changes if np.isfinite(one).any()), 1.0))


def _noise_sigma(inverse_depth: Floats, band: Mask, apart: int) -> float:
    """Standard deviation of a sample, 1/mm, from what it is off the line from the one before to the one after it.

    They stand in one column, where noise is uncorrelated, and count alike where most were lost.
    """
    every = np.ascontiguousarray(band[::apart].T)
    col, row = np.nonzero(every)
    value = inverse_depth[::apart].T[every]
    span = row[2:] - row[:-2]
    together = (col[2:] == col[:-2]) & (span <= MAX_SPAN)
    share = ((row[1:-1] - row[:-2]) / np.maximum(span, 1))[together]
    before, own, after = (part[together] for part in (value[:-2], value[1:-1], value[2:]))
    off = (own - (1.0 - share) * before - share * after) / np.sqrt(1.0 + share**2 + (1.0 - share) ** 2)
    floor = MIN_NOISE_MM * float(np.nanmedian(inverse_depth)) ** 2
    return max(robust_sigma(off), floor) if off.size >= LEAST_SPANS else floor
