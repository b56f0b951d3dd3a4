"""Quadratics through the points of discs on the page: they predict other points.

Next to a crease a disc that ends before it is a better neighbour's than the point's own (shiftable windows, after
Kuwahara 1976; `range_image.facet_model` does so on a grid).
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from restore.scan import Floats, Ints

TERMS = 6
MIN_POINTS = 12  # in a disc: twice the unknowns
CLEAN = 1.8  # standard deviations about a quadratic: thirty points without a crease stay below 1.5
RIDGE = 1e-9  # of the normal equations' trace: points in a row leave a quadratic undetermined


@dataclass(frozen=True, eq=False)
class Discs:
    """A quadratic over its own plane for the disc round each point.

    middles   (n, 3) mm.
    frames    (n, 3, 3) rows: two axes in the plane, and its normal.
    terms     (n, 6) of 1, x, y, x², xy, y².
    inverses  (n, 6, 6) inverse of the normal equations' matrix.
    misfits   (n,) mm, standard deviation of the points about it; infinite for too few points.
    """

    middles: Floats
    frames: Floats
    terms: Floats
    inverses: Floats
    misfits: Floats

    def best(self, starts: Ints, members: Ints) -> Ints:
        """Return the disc (n,) of least misfit that each point lies in.

        starts, members: the discs' points as in `fit_discs`.
        """
        return _best(starts, members, self.misfits)

    def discrepancies(self, discs: Ints, points: Floats, bends: Floats, sigma: float) -> Floats:
        """Return normalised distances (k,) of points from quadratics of discs.

        Over what noise and bending leave; infinite for discs that hold a crease.
        discs: (k,).
        points: (k, 3) mm.
        bends: (k,) mm, by how much paper without a crease leaves a quadratic.
        sigma: noise of a point, mm.
        """
        local = np.einsum("kij,kj->ki", self.frames[discs], points - self.middles[discs])
        x, y, height = local.T
        terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
        leverage = np.einsum("ki,kij,kj->k", terms, self.inverses[discs], terms)
        off = height - (terms * self.terms[discs]).sum(axis=1)
        noise = sigma * np.sqrt(1.0 + leverage) + bends
        return np.where(self.misfits[discs] < CLEAN * sigma, np.abs(off) / noise, np.inf)


@numba.njit(cache=True, nogil=True)
def fit_discs(points: Floats, starts: Ints, members: Ints) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Fit the discs of points (n, 3) mm, as the fields of `Discs`.

    Disc k has the points members[starts[k] : starts[k + 1]].
    """
    count = len(starts) - 1
    middles, frames = np.zeros((count, 3)), np.zeros((count, 3, 3))
    terms, inverses, misfits = np.zeros((count, TERMS)), np.zeros((count, TERMS, TERMS)), np.full(count, np.inf)
    row = np.empty(TERMS)
    for k in range(count):
        own = members[starts[k] : starts[k + 1]]
        if len(own) < MIN_POINTS:
            continue
        for i in own:
            middles[k] += points[i] / len(own)
        scatter = np.zeros((3, 3))
        for i in own:
            off = points[i] - middles[k]
            scatter += np.outer(off, off)
        axes = np.linalg.eigh(scatter)[1]
        frames[k] = axes.T[::-1]
        gram, side, square = np.zeros((TERMS, TERMS)), np.zeros(TERMS), 0.0
        for i in own:
            local = frames[k] @ (points[i] - middles[k])
            x, y = local[0], local[1]
            row[0], row[1], row[2], row[3], row[4], row[5] = 1.0, x, y, x * x, x * y, y * y
            gram += np.outer(row, row)
            side += row * local[2]
            square += local[2] ** 2
        gram += RIDGE * np.trace(gram) * np.eye(TERMS)
        inverses[k] = np.linalg.inv(gram)
        terms[k] = inverses[k] @ side
        misfits[k] = np.sqrt(max(square - (terms[k] * side).sum(), 0.0) / (len(own) - TERMS))
    return middles, frames, terms, inverses, misfits


@numba.njit(cache=True)
def _best(starts: Ints, members: Ints, misfits: Floats) -> Ints:
    best, least = np.arange(len(misfits)), misfits.copy()
    for k in range(len(misfits)):
        for i in members[starts[k] : starts[k + 1]]:
            if misfits[k] < least[i]:
                best[i], least[i] = k, misfits[k]
    return best
