"""Denoise a range grid without rounding its creases: the facet model.

Every sample gets the quadratic that fits inverse depth best in a window round it (Haralick & Watson, "A facet model
for image data", 1981), or where the surface bends too fast for one, a fit over its tangent plane. Near a crease it
takes that of a window that ends at the crease, from its own side (shiftable windows, after Kuwahara 1976).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numba
import numpy as np
from numpy.typing import NDArray

from restore.errors import NotEnoughSurface
from restore.numerics.limits import TINY
from restore.numerics.robust import MAJORITY, OUTLYING, robust_sigma
from restore.range_image.facets.creases import find_creases
from restore.range_image.facets.quadratic_fit import MAX_LEVERAGE, MIN_SAMPLES, Quadratics, fit_quadratics
from restore.range_image.facets.tangent_fit import FIELDS, fit_over_tangents
from restore.runtime.threads import in_bands
from restore.scan import Floats, Ints, Mask

WIDE_RADIUS = 3  # 7×7 samples: the slope's noise is 1/14 of the depth's, per sample
NARROW_RADIUS = 2  # 5×5 samples between creases that leave no room for more
SPARSE_RADII = (6, 12)  # of windows with as many samples where a quarter, or a sixteenth, is left
MAX_BEND_SIGMAS = 6.0  # σ of the noise: rise of the quadratic over the wide window, beyond which higher terms matter
MAX_MISFIT_SIGMAS = 1.5  # residual over the noise; with 43 degrees of freedom noise alone stays below 1.3
PASSES = 3  # the first is biased by the outliers that it detects; the third changes slopes by less than the noise
PRECISION = 3e-6  # of the depth, a quarter of the scanner's best: least noise, or exact data would be all outliers
SIGNAL_CLASSES = 8  # enough to separate ink, half-tones and paper
SHIFT_PENALTY = 0.02  # of the merit, per sample of shift
# Until the creases are known windows are missing at the border whose quadratic passes three columns exactly,
# and so would pass a column of the table (leverage 0.3).
LEVERAGE_BEFORE_CREASES = 0.25
FACET_FIELDS = 6  # value, slope per column, slope per row, variance, bend, 1 when on one side of a crease


@dataclass(frozen=True, eq=False)
class Facets:
    """Denoised inverse depth and its slope at every sample.

    value: (rows, cols) 1/mm, NaN outside the surface.
    slope: (rows, cols, 2), change of value per column and per row, on the sample's own side of a crease.
    crease: (rows, cols), True on a crease.
    noise: standard deviation of a sample of the best signal class, 1/mm.
    """

    value: Floats
    slope: Floats
    crease: Mask
    noise: float


def fit_facets(
    inverse_depth: Floats,
    measured: Mask,
    inside: Mask,
    spacing: float,
    signal: Floats | None = None,
    *,
    precision: float = PRECISION,
    radius: int = WIDE_RADIUS,
    wide_creases: bool = False,
) -> Facets:
    """Fit facets to inverse depth at every sample with enough neighbours.

    Neighbours count where measured. Outliers, such as mixed pixels at the edges of ink, have weight 0.
    inverse_depth: (rows, cols) 1/mm.
    inside: (rows, cols), where to fit.
    spacing: of the rays, from column to column at a depth of 1.
    signal: (rows, cols), in any unit, the light that each sample returned; samples with little have more noise and less
        weight.
    precision: fraction of the depth, the least noise that is assumed.
    radius: samples, of the wide window. wide_creases: leave out the samples next to creases, too.
    Raises NotEnoughSurface when the samples are too sparse for any facet.
    """
    level = float(np.median(inverse_depth[measured]))
    data = np.where(measured, inverse_depth - level, 0.0)
    classes = signal_classes(signal, measured & inside)
    weight, floor, steep = measured.astype(float), precision * level, spacing * level
    for _ in range(PASSES):
        facets, _ = _fit_windows(data, weight, inside, floor, None, steep, radius)
        weight, deviation = _weights(np.where(measured, data - facets[..., 0], np.nan), classes, floor)
    clean = np.where(weight > 0, data, facets[..., 0])
    crease = find_creases(np.where(inside, clean, 0.0), np.where(weight > 0, deviation, 0.0), inside)
    if wide_creases:
        crease = inside & cv2.dilate(crease.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    sided = np.where(crease, 0.0, weight)  # samples on a crease belong to neither side
    facets, noise = _fit_windows(data, sided, inside, floor, crease, steep, radius)
    return Facets(np.where(inside, facets[..., 0] + level, np.nan), facets[..., 1:3], crease, noise)


def in_whole_windows(known: Mask, radius: int = WIDE_RADIUS) -> Mask:
    """Return where the wide window is centred on its sample.

    All of it is known, without a crease. Returns (rows, cols) bool.
    """
    return np.asarray(cv2.distanceTransform(known.astype(np.uint8), cv2.DIST_L2, 5) > radius + 1)


def signal_classes(signal: Floats | None, measured: Mask) -> NDArray[np.int8]:
    """Return the class (rows, cols) of each sample by its signal.

    0 is the strongest; −1 where nothing was measured.
    """
    if signal is None:
        return np.where(measured, np.int8(0), np.int8(-1))
    strongest = np.percentile(signal[measured], 95)
    fraction = np.clip(signal / max(strongest, TINY), 0.0, 1.0)
    return np.where(
        measured, np.minimum((1.0 - fraction) * SIGNAL_CLASSES, SIGNAL_CLASSES - 1).astype(np.int8), np.int8(-1)
    )


def _weights(residual: Floats, classes: NDArray[np.int8], floor: float) -> tuple[Floats, Floats]:
    """Return the inverse variance of each sample's class, and its sigma.

    The variance (rows, cols) is relative to the best class, 0 for outliers; sigma (rows, cols) is in 1/mm.
    """
    known, sigmas, weights = np.isfinite(residual), np.zeros(SIGNAL_CLASSES + 1), np.zeros(SIGNAL_CLASSES + 1)
    best, (of_class, among) = np.inf, (grid[known & (classes >= 0)] for grid in (classes, residual))
    for k in range(classes.max() + 1):
        members = among[of_class == k]
        if len(members) < MIN_SAMPLES:
            continue
        sigmas[k] = max(robust_sigma(members), floor)
        best = min(best, sigmas[k])
        weights[k] = (best / sigmas[k]) ** 2
    deviation, off = sigmas[classes], np.where(known, np.abs(residual), 0.0)  # class −1 has the last entry, 0
    limit = OUTLYING * np.maximum(deviation, _median_around(off))  # where all are off, the quadratic does not fit
    return np.where(off < limit, weights[classes], 0.0), deviation


def _median_around(values: Floats) -> NDArray[np.float32]:
    """Return the median (rows, cols) of values in narrow windows.

    Beyond the border they count as 0.
    """
    radius = NARROW_RADIUS
    return np.asarray(
        cv2.medianBlur(np.pad(values.astype(np.float32), radius), 2 * radius + 1)[radius:-radius, radius:-radius]
    )


def _fit_windows(
    data: Floats, weight: Floats, inside: Mask, floor: float, crease: Mask | None, steep: float, radius: int
) -> tuple[Floats, float]:
    """The facet (rows, cols, FACET_FIELDS) of every sample, and the noise, 1/mm.

    As long as the creases are unknown they show as misfit, and no surface is fitted over tangent planes: it would round
    them off, and so hide them.
    """
    leverage = LEVERAGE_BEFORE_CREASES if crease is None else MAX_LEVERAGE
    wide = fit_quadratics(data, weight, inside, radius, leverage)
    variance = wide.variance[inside & (weight > 0) & np.isfinite(wide.variance)]
    if not len(variance):
        raise NotEnoughSurface("the samples lie too far apart", "raise the laser power for dark paper, and scan again")
    noise2 = max(float(np.median(variance)), floor**2)
    limit = MAX_MISFIT_SIGMAS**2 * noise2
    distance = None if crease is None else _distance(crease, radius)
    facets, centres = np.full((*data.shape, FACET_FIELDS), np.nan), np.zeros(data.shape, np.int64)
    _shift_windows(wide, distance, limit, inside, radius, facets, centres)
    one_sided = facets[..., 5] > 0
    bent = facets[..., 4] > MAX_BEND_SIGMAS * np.sqrt(noise2)
    unfit = inside & (bent | ~((facets[..., 3] <= limit) & one_sided))
    if crease is not None:
        tangent = fit_over_tangents(data, weight, unfit, wide.terms, centres, steep, radius)
        better = unfit & (tangent[..., 3] <= limit) & one_sided
        facets[better, :FIELDS] = tangent[better]
        unfit &= ~better
    sparse = inside & np.isnan(wide.variance)
    if crease is not None:
        sparse |= inside & _sparse(inside & (weight > 0), inside, radius)
    window = np.ones((2 * NARROW_RADIUS + 1, 2 * NARROW_RADIUS + 1), np.uint8)
    near = inside & cv2.dilate(unfit.astype(np.uint8), window).astype(bool)
    # The wide fits have been used: new arrays of their size take as long as these fits.
    close = fit_quadratics(data, weight, near, NARROW_RADIUS, leverage, replacing=wide)
    _shift_windows(close, distance, limit, unfit, NARROW_RADIUS, facets, centres)
    _fit_sparse(facets, data, weight, sparse, limit, close)
    return facets, float(np.sqrt(noise2))


def _sparse(used: Mask, inside: Mask, radius: int) -> Mask:
    """Return where less than half of the samples in a wide window are used.

    Of those inside: where dark ink leaves fewer, slopes are twice as uncertain. Returns (rows, cols) bool.
    """
    size = (2 * radius + 1,) * 2
    counted = inside.astype(np.float32) * MAJORITY - used
    return np.asarray(cv2.boxFilter(counted, -1, size, borderType=cv2.BORDER_CONSTANT) > 0.0)


def _fit_sparse(
    facets: Floats, data: Floats, weight: Floats, sparse: Mask, limit: float, replacing: Quadratics
) -> None:
    """Replace the facets of sparse samples by fits in larger windows.

    The windows hold enough samples. Only where a quadratic fits so far: between the sides of a crease it does not, and
    each continues separately.
    sparse: (rows, cols).
    replacing: fits that are no longer needed.
    """
    for radius in SPARSE_RADII:
        if not sparse.any():
            return
        fit = fit_quadratics(data, weight, sparse, radius, LEVERAGE_BEFORE_CREASES, replacing=replacing)
        found = sparse & (fit.variance <= limit)
        at = np.nonzero(found)
        facets[at] = np.column_stack(
            [fit.terms[at][:, :3], fit.variance[at], np.zeros(len(at[0])), np.ones(len(at[0]))]
        )
        sparse = sparse & ~found


def _distance(crease: Mask, radius: int) -> Floats:
    """Return the distance (rows, cols) to the nearest crease, samples.

    More than a window's reach where creases are absent.
    """
    if not crease.any():
        return np.full(crease.shape, float(2 * radius + 1))
    return cv2.distanceTransform((~crease).astype(np.uint8), cv2.DIST_L2, 5).astype(np.float64)


def _shift_windows(
    fit: Quadratics, distance: Floats | None, limit: float, inside: Mask, radius: int, facets: Floats, centres: Ints
) -> None:
    """Write the facet of each sample by the best window that contains it.

    That is its own, or near a crease, or where its own has too few samples, a shifted one: the farthest from creases,
    whose distances (rows, cols) are given, or where they are unknown the one of least misfit. Facets on one side of a
    crease replace what is there already.
    fit: (rows, cols, FACET_FIELDS), written.
    centres: (rows, cols), index of that window, written.
    """
    if distance is None:
        merit, shifted, one_sided_merit = -fit.variance, ~(fit.variance < limit), -limit
    else:
        near = (distance <= radius + 1.5) | np.isnan(fit.variance)
        merit, shifted, one_sided_merit = distance, near, float(radius)

    def choose(rows: slice) -> None:
        first, end = rows.start, rows.stop
        _choose_windows(*fit, merit, shifted, inside, one_sided_merit, radius, first, end, facets, centres)

    in_bands(choose, len(merit))


@numba.njit(cache=True, nogil=True)
def _choose_windows(
    terms: Floats, variance: Floats, merit: Floats, shifted: Mask, inside: Mask, one_sided_merit: float, radius: int,
    first: int, end: int, chosen: Floats, centres: Ints,
) -> None:  # fmt: skip
    """Write the facets and the centres of the rows from first to end."""
    rows, cols = merit.shape
    for r in range(first, end):
        for c in range(cols):
            if not inside[r, c]:
                continue
            best_r, best_c, best = r, c, -np.inf
            if shifted[r, c]:
                for i in range(max(0, r - radius), min(rows, r + radius + 1)):
                    for j in range(max(0, c - radius), min(cols, c + radius + 1)):
                        # Of two equally good windows the nearer: its quadratic extrapolates less.
                        score = merit[i, j] - SHIFT_PENALTY * abs(merit[i, j]) * (abs(i - r) + abs(j - c))
                        if score > best and not np.isnan(variance[i, j]):
                            best_r, best_c, best = i, j, score
            one_sided = merit[best_r, best_c] >= one_sided_merit
            if not (one_sided or np.isnan(chosen[r, c, 0])):
                continue
            centres[r, c] = best_r * cols + best_c
            f = terms[best_r, best_c]
            x, y = c - best_c, r - best_r
            chosen[r, c, 0] = f[0] + f[1] * x + f[2] * y + f[3] * x * x + f[4] * x * y + f[5] * y * y
            chosen[r, c, 1] = f[1] + 2 * f[3] * x + f[4] * y
            chosen[r, c, 2] = f[2] + f[4] * x + 2 * f[5] * y
            chosen[r, c, 3] = variance[best_r, best_c]
            chosen[r, c, 4] = (abs(f[3]) + abs(f[4]) + abs(f[5])) * WIDE_RADIUS * WIDE_RADIUS
            chosen[r, c, 5] = 1.0 if one_sided else 0.0
