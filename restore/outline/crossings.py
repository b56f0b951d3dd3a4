"""Crossings of the outline between samples, and sides that separate them.

A straight side separates the samples on the page from those beyond. Each crossing gives the side to a sample. Where the
side is oblique in the image it passes by the samples at all distances, and of those on the page the outermost, of those
beyond the innermost give its place to a small part of one.
"""

from __future__ import annotations

from math import sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.special import logsumexp

from restore.range_image.facets.sheet import PageOnGrid, Sheet
from restore.scan import Floats, Ints, Mask

REACHES = (1.0, 0.1)  # samples to either side of the mean of the crossings, and then of the place that is found
PLACES = 41  # within a reach: a twentieth of a sample apart, and then a two hundredth
RAGGED = np.array([0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005])  # samples an outline may scatter by, no layout is surer
WRONG = 0.2  # of the samples are assumed to be lost next to ink, or specks of the table, whatever their distance
# samples by which all along a row seem too far in or out. Against simulated truth a side is off by 0.15 where it
# crosses no row, by 0.05 where it crosses two, by 0.01 with five: it passes by samples at all distances then.
SHARED = 0.2
SHARED_SIGMAS = 2.0  # of that, to either side, are reckoned with
ANOTHER = 0.01  # of the sides that a picture shows are the edge of something else
CLOSE = 0.1  # samples: the layout of a good page is known to that


class Crossings(NamedTuple):
    """Where the outline passes between two neighbouring samples.

    nodes      (k, 2) grid positions half-way.
    samples    (k, 2, 2) mm: where the one on the page lies on it, and where the one beyond would.
    jacobians  (k, 2, 2) samples/mm: of grid position by flat position there.
    """

    nodes: Floats
    samples: Floats
    jacobians: Floats

    @property
    def places(self) -> Floats:
        """Return the flat positions (k, 2) mm half-way."""
        return np.asarray(self.samples.mean(axis=1))


def crossings_of(sheet: Sheet, page: PageOnGrid, border: Ints, jacobians: Floats) -> Crossings:
    """Return all k crossings of a page.

    border: (b,), vertices on it.
    jacobians: (b, 2, 2), those there.
    """
    first = [np.argwhere(np.diff(sheet.inside, axis=axis)) for axis in (0, 1)]
    steps = np.repeat(np.eye(2, dtype=int), [len(one) for one in first], axis=0)
    places = np.concatenate(first)[:, None] + np.stack([np.zeros_like(steps), steps], axis=1)
    leaves = sheet.inside[tuple(places[:, 0].T)]
    places = np.where(leaves[:, None, None], places, places[:, ::-1])
    nodes = places.mean(axis=1)
    _, nearest = cKDTree(page.nodes[border]).query(nodes)
    off = places - page.nodes[border][nearest][:, None]
    samples = page.flat[border][nearest][:, None] + np.einsum("kij,ksj->ksi", np.linalg.pinv(jacobians)[nearest], off)
    return Crossings(nodes, samples, jacobians[nearest])


def where(crossings: Crossings, chosen: Mask) -> Crossings:
    """Those of k crossings that are chosen (k,)."""
    return Crossings(*(field[chosen] for field in crossings))


class PictureEdge(NamedTuple):
    """A side as the colour image shows it.

    It has an offset along the side's normal, and the standard deviation of that, mm.
    """

    offset: float
    sigma: float


class Separation(NamedTuple):
    """How a line separates the samples on the page from those beyond.

    offset: mm along its normal.
    log_likelihood: of the likeliest offset, comparable between normals that all were seen, or all were not.
    right: fraction of the samples that are on their side of it, or at most CLOSE beyond it.
    """

    offset: float
    log_likelihood: float
    right: float


def separate(crossings: Crossings, normal: Floats, seen: PictureEdge | None = None) -> Separation:
    """Return how the straight side with a given normal separates samples.

    Its offset is the mean over all places, each weighted by its likelihood, however ragged the outline is, and by where
    the side was seen. A chance that a sample is wrong, whatever its distance, keeps lost ones from drawing a side in
    that is oblique. Along a row samples have a common error: however many they are, they do not outvote the image
    there.
    crossings: k of them.
    normal: (2,), unit vector that points outwards.
    """
    shared = 0.0 if seen is None else _shared_error(crossings)
    across = crossings.samples @ normal
    per_mm = np.linalg.norm(crossings.jacobians @ normal, axis=1)[:, None]
    found, most = float(across.mean()), -np.inf
    for reach in REACHES:
        step = 2.0 * reach / (PLACES - 1)
        beyond = int(SHARED_SIGMAS * shared / step)
        steps = np.arange(-beyond, PLACES + beyond) - PLACES // 2
        log_likelihood = _log_likelihood(found + steps * step / per_mm.mean(), across, per_mm)
        if beyond:
            likely = _normal_density(np.arange(-beyond, beyond + 1) * step / shared)
            shifted = sliding_window_view(log_likelihood, len(likely), axis=1)
            log_likelihood = logsumexp(shifted, axis=2, b=likely / likely.sum())
        places = found + steps[beyond : beyond + PLACES] * step / per_mm.mean()
        if seen is not None:
            density = (
                _normal_density((places - seen.offset) / seen.sigma) / seen.sigma / per_mm.mean()
            )  # for each sample
            # In the right direction the steps that were seen scatter least.
            log_likelihood += np.log(ANOTHER + (1.0 - ANOTHER) * density) - len(across) * np.log(seen.sigma)
        most = float(log_likelihood.max())
        found = float(np.average(places, weights=np.exp(log_likelihood - most).sum(axis=0)))
    right = (found - across) * per_mm * [1.0, -1.0] > -CLOSE
    return Separation(found, most, float(right.mean()))


def _normal_density(x: NDArray[np.floating[Any]]) -> Floats:
    """Return the density of the standard normal distribution.

    Importing scipy.stats for it takes longer than its use.
    """
    return np.asarray(np.exp(-(x**2) / 2.0) / np.sqrt(2.0 * np.pi))


def _shared_error(crossings: Crossings) -> float:
    """Return the common error of the samples of k crossings, samples.

    The more rows, or columns, the side crosses, the less it is.
    """
    crossed = sqrt(12.0) * float(crossings.nodes.std(axis=0).min())  # of an even spread over them
    return SHARED / (1.0 + crossed)


def _log_likelihood(places: Floats, across: Floats, per_mm: Floats) -> Floats:
    """Return the log-likelihood of a side at each place for each of RAGGED.

    places: (p,) mm.
    across: (k, 2) mm.
    per_mm: (k, 1), samples.
    Returns (r, p), for RAGGED (r,).
    """
    # Samples by which one lies within a side at this place, in single precision, which takes a quarter of the time.
    within = ((places[:, None, None] - across) * per_mm * [1.0, -1.0]).astype(np.float32)
    agree = np.tanh(within / (2.0 * RAGGED).astype(np.float32)[:, None, None, None])  # from −1 to 1, a logistic step
    return np.asarray(np.log(0.5 + (0.5 - WRONG) * agree).sum(axis=(2, 3), dtype=np.float64))
