"""Surface of a table: the likeliest plane, or one bowed a little.

It is fitted to means of small blocks of samples, of which noise is a hundredth of a millimetre or two: a plane tilted
through a table and a page just above it lies within the noise of single samples, but not within that of blocks. No
table is as even as that, though: the likelihood determines how uneven it is, and whether it is bowed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from restore.numerics.robust import SIGNIFICANT
from restore.scan import Floats, Ints, Mask

BORDER_BAND = 12  # samples: the table reaches the border of the picture, the sheet should not
BLOCK = BORDER_BAND // 2  # samples a side: a mean has a sixth of the noise of one
TRIALS = 200  # of three blocks: with a quarter on the table, one trial in 64 hits it
LIKELY = 3  # trials that are refined: which of those on one surface is the best is noise
REFINEMENTS = 8  # a plane on one part of a bowed table takes some steps to the next part
UNEVEN_MM = (0.05, 0.15, 0.4)  # a significant deviation, besides noise: ink on paper, boards, cloth in wrinkles
SPREAD_MM = 3.0  # heights of what lies on a table: one is as likely as another
PLANE, BOWED = 3, 6  # terms of a plane, the first of those of a bowed surface


class Blocks(NamedTuple):
    """The means of samples in blocks of a range image.

    terms    (n, 6) of their places: see terms_of.
    heights  (n,) mm.
    noise    (n,) mm, the standard deviation of a height.
    weights  (n,) of their samples, 1 in the mean.
    """

    terms: Floats
    heights: Floats
    noise: Floats
    weights: Floats


class TableSurface(NamedTuple):
    """A surface of heights terms · factors.

    factors  (6,) mm.
    uneven   mm: the standard deviation of the means of blocks from it, besides noise.
    """

    factors: Floats
    uneven: float

    def of(self, blocks: Blocks) -> Mask:
        """Return which blocks are on the surface, (n,) bool."""
        off = np.abs(blocks.heights - blocks.terms @ self.factors)
        return np.asarray(off < SIGNIFICANT * _sigma(blocks, self.uneven))

    def evidence(self, blocks: Blocks, parameters: int) -> float:
        """Return the Bayesian information criterion of a surface.

        It is twice the logarithm of how likely its parameters make all blocks, less their cost (Schwarz, 1978: BIC).
        What is not on the surface may be on a second one, as far from it everywhere: a page that lies on its table.
        """
        sigma = _sigma(blocks, self.uneven)
        off = blocks.heights - blocks.terms @ self.factors
        off_surface = np.abs(off) >= SIGNIFICANT * sigma
        step = np.median(off[off_surface]) if off_surface.any() else np.inf
        fraction = blocks.weights @ (np.abs(off - step) < SIGNIFICANT * sigma) / blocks.weights.sum()
        likely = (1.0 - fraction) * _normal(off / sigma) + fraction * _normal((off - step) / sigma)
        return float(2.0 * blocks.weights @ np.log(likely / sigma + 1.0 / SPREAD_MM) - parameters * np.log(len(off)))


def _sigma(blocks: Blocks, uneven: float) -> Floats:
    """Return the standard deviation (n,) mm of each block's height over an uneven surface."""
    return np.hypot(blocks.noise, uneven)


def _normal(off: Floats) -> Floats:
    """Return the normal density (n,) at `off` standard deviations (n,)."""
    return np.asarray(np.exp(-0.5 * off**2) / np.sqrt(2.0 * np.pi))


def terms_of(x: Floats, y: Floats) -> Floats:
    """Return the terms (…, 6) 1, x, y, x², xy, y² of places (…)."""
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)


def block_numbers(band: Mask) -> Ints:
    """Return the block number (n,) of each sample of a band, from 0.

    band: (rows, cols).
    """
    row, col = np.nonzero(band)
    return np.unique(row // BLOCK * band.shape[1] + col // BLOCK, return_inverse=True)[1]


def blocks_of(numbers: Ints, terms: Floats, heights: Floats, noise: float, apart: int) -> Blocks:
    """Average samples into blocks.

    numbers: (n,), the block of each sample.
    terms: (n, 6).
    heights: (n,) mm, with a noise, mm.
    apart: distance in samples from which on noise is independent.
    """
    count = np.bincount(numbers)
    means = np.stack([np.bincount(numbers, column) / count for column in (*terms.T, heights)], axis=1)
    independent = np.maximum(count / apart**2, 1.0)
    return Blocks(means[:, :-1], means[:, -1], noise / np.sqrt(independent), count / count.mean())


def likeliest_surface(blocks: Blocks, everywhere: Floats, most_mm: float) -> TableSurface | None:
    """Return the likeliest surface of blocks, None if they are on a line.

    everywhere: (n, 6), terms of samples all over the image.
    most_mm: the most that a surface is bowed over them.
    """
    planes = _planes_of_three(blocks)
    if not len(planes):
        return None
    found: list[tuple[float, TableSurface]] = []
    off, bends = np.abs(blocks.heights[:, None] - blocks.terms @ planes.T), _bends(everywhere)
    for uneven in (some / SIGNIFICANT for some in UNEVEN_MM):
        for plane in planes[_likely(off, blocks, uneven)]:
            flat = _refined(TableSurface(plane, uneven), blocks, PLANE)
            bowed = _refined(flat, blocks, BOWED)
            found.append((flat.evidence(blocks, PLANE), flat))
            if np.ptp(bends @ bowed.factors[PLANE:]) < most_mm:
                found.append((bowed.evidence(blocks, BOWED), bowed))
    return max(found, key=lambda one: one[0])[1]


def _planes_of_three(blocks: Blocks) -> Floats:
    """Return candidate planes (k, 6), each through three blocks.

    The blocks are drawn by their samples and are not on a line. A plane is given by its factors.
    """
    random = np.random.default_rng(0)  # fixed: the same scan gives the same page
    chance = blocks.weights / blocks.weights.sum()
    triples = random.choice(len(chance), (TRIALS, PLANE), p=chance)
    flat = blocks.terms[:, :PLANE]
    triples = triples[np.abs(np.linalg.det(flat[triples])) >= 1.0]
    planes = np.linalg.solve(flat[triples], blocks.heights[triples][..., None])[..., 0]
    return np.pad(planes, ((0, 0), (0, BOWED - PLANE)))


def _likely(off: Floats, blocks: Blocks, uneven: float) -> Ints:
    """Return the LIKELY planes of least squared deviation, (LIKELY,).

    off: (n, k) mm, of blocks from k planes, each limited to SIGNIFICANT (MSAC: Torr & Zisserman, "MLESAC", 2000).
    """
    limit = SIGNIFICANT * _sigma(blocks, uneven)
    squares = blocks.weights @ np.minimum(off / limit[:, None], 1.0) ** 2
    return np.asarray(np.argsort(squares)[:LIKELY])


def _refined(surface: TableSurface, blocks: Blocks, parameters: int) -> TableSurface:
    """Return a surface of `parameters` terms fitted to the blocks on it.

    Locally optimised RANSAC (Chum, Matas & Kittler, 2003).
    """
    fitted_to = np.zeros(len(blocks.heights), bool)
    for _ in range(REFINEMENTS):
        on = surface.of(blocks)
        if on.sum() < parameters or (on == fitted_to).all():
            break
        fitted_to = on
        weights = 1.0 / _sigma(blocks, surface.uneven)[on]
        design = blocks.terms[on, :parameters] * weights[:, None]
        fitted = np.linalg.lstsq(design, blocks.heights[on] * weights, rcond=None)[0]
        surface = surface._replace(factors=np.pad(fitted, (0, BOWED - parameters)))
    return surface


def _bends(terms: Floats) -> Floats:
    """Return the part of the quadratic terms that no plane explains.

    terms: (n, 6). Returns (n, 3), residuals of x², xy, y² from a least-squares plane.
    """
    flat, bent = terms[:, :PLANE], terms[:, PLANE:]
    return np.asarray(bent - flat @ np.linalg.lstsq(flat, bent, rcond=None)[0])
