"""Obstructions of a photograph: a hand, a pen, another sheet, glare.

Photograph P and scan S show one print by two lights: near a place P is S times a gain that changes slowly, and the
gains of the three colours change alike. Three departures from that contradict the page, each measured on the coarse
page, where both pictures have one resolution:

    print      the contrast of P relative to its local mean is not that of S: other structure, or none
    colour     the ratio of the gains of two colours departs from what lamps give to a surface of this shape
    level      the gain itself departs from that by more than the shadows of a page make

What lamps give is a quadratic of the place on the page and of the surface's normal, fitted to most of the page.

Where the contrasts agree, the place is confirmed. Round a contradiction all that is not confirmed counts as covered, as
far as it is connected and near: the margin of another sheet over a margin of the page contradicts nothing by itself. So
does, at any distance, what contradictions cut off from the page and nothing confirms, as the inside of a sleeve.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt, label

from restore.numerics.limits import SINGLE_TINY
from restore.numerics.robust import MAD_TO_SIGMA, MAJORITY
from restore.photo.coarse import COARSE_MM
from restore.scan import Floats, Mask

WINDOW_MM = 3.5  # standard deviation of the window in which contrasts are compared: it spans two lines of text
CONTRAST_FLOOR = 0.12  # relative contrast that creases lit from two sides give to blank paper
BLEND_MM = 1.2  # of the window of gains: wider than the misregistration of a crumpled page
NARROW_MM = 1.5  # of a second window, in which nothing that is confirmed differs: the rim of a pen among print
REACH_MM = 40.0  # of a contradiction: the blank margins of a sheet, the width of a sleeve
DARK = 0.02  # fraction of white: below it the colour of a gain is noise
COLOUR_LIMIT = 0.25  # of the logarithm: two lamps of two colours on a curved page differ by half as much
COLOUR_PER_SATURATION = 0.5  # relative; cameras differ in saturated print by that much of its saturation
LEVEL_LIMITS = (np.log(4.0), np.log(2.5))  # darker, brighter: no shadow on a page takes three quarters of its light
MIN_MM2 = 12.0  # of a contradiction: the tip of a pen; a fleck of ink is less
RIM_MM = 1.8  # the outline of the page is known to a sample, and the photograph shows the table there
# Round what covers the page: its blurred edge and its contact shadow, 2 mm, and the gap between two lines of print: a
# window confirms the blank margin of another sheet that ends in it.
MARGIN_MM = 4.5
FITS = 8  # reweightings of what lamps give: what covers a third of the page is an outlier after half as many
SAMPLED = 4000  # places that a fit takes
WHOLE_MM = 3.0  # radius of a disc that is confirmed whole: slivers agree by chance


@dataclass(frozen=True, eq=False)
class Agreement:
    """Where a photograph (h, w) contradicts the page, and where it confirms it."""

    contradicted: Mask
    confirmed: Mask


def covered_mask(
    photograph: Floats,
    scan: Floats,
    normals: Floats,
    seen: Mask,
    known: Mask,
    resolved: Mask | None = None,
    glare: Mask | None = None,
) -> Mask:
    """Return where something covers the page in a photograph.

    photograph, scan: (h, w, 3), linear light on the coarse page.
    normals: (h, w, 3), of its surface.
    seen: (h, w), where the photograph shows the page.
    known: (h, w), where the scan does.
    resolved: (h, w), where both show print; everywhere by default.
    glare: (h, w), where the photograph is clipped; it counts as covered, and not as seen.
    Returns (h, w) bool.
    """
    glare = np.zeros_like(seen) if glare is None else glare
    both = seen & known
    both &= distance_transform_edt(np.pad(both, 1))[1:-1, 1:-1] * COARSE_MM > RIM_MM
    both &= ~glare
    if not both.any():
        return glare
    found = compare(photograph, scan, normals, both, both if resolved is None else resolved)
    seeds = found.contradicted
    # White paper that is clipped next to a contradiction belongs to the same thing, and hides its print.
    seeds = seeds | _connected(glare, _grown(seeds, BLEND_MM) & glare)
    near = _grown(seeds, REACH_MM)
    confirmed = _opened(found.confirmed, WHOLE_MM)
    covered = _connected(both & ~confirmed & near, seeds)
    covered |= _unconfirmed_parts(covered, confirmed, both)
    if not covered.any():
        return glare
    # The rim, and what the scanner did not see, go with the nearest place that could be compared.
    rows, cols = distance_transform_edt(~both, return_distances=False, return_indices=True)
    near = distance_transform_edt(~covered[rows, cols]) * COARSE_MM
    return np.asarray(glare | (seen & (near <= MARGIN_MM)))


def compare(photograph: Floats, scan: Floats, normals: Floats, both: Mask, resolved: Mask) -> Agreement:
    """Compare two pictures (h, w, 3) of the coarse page, linear light.

    normals: (h, w, 3), of the surface.
    both: (h, w), where both pictures show the page.
    resolved: (h, w), where both show its print. Elsewhere print neither contradicts nor confirms.
    """
    resolved = resolved & both  # nor is what is not resolved part of the contrast next to it
    gains, terms = _log_gains(photograph, scan, both), _light_terms(normals, both)
    level = gains.mean(axis=2)
    lamps = _fitted(level, terms, both)
    grey, scanned_grey = photograph.mean(axis=2) / np.exp(lamps), scan.mean(axis=2)
    wide, narrow = (_contrasts(grey, scanned_grey, resolved, width) for width in (WINDOW_MM, NARROW_MM))
    printed = wide.scanned > CONTRAST_FLOOR**2
    colour = gains - level[..., None]
    tint = np.abs([colour[..., k] - _fitted(colour[..., k], terms, both) for k in range(3)]).max(axis=0)
    tint = tint / (COLOUR_LIMIT + COLOUR_PER_SATURATION * _saturation(scan, both))
    change = level - lamps
    change = np.maximum(-change / LEVEL_LIMITS[0], change / LEVEL_LIMITS[1])
    field = np.maximum(tint, change)
    step = np.abs(level - lamps - _local(level - lamps, both, WINDOW_MM))
    # What contradicts has half of that likeness left somewhere: contrasts that a crease displaces by a cell or two pass
    # the limits by a little.
    other_print, surely = (
        resolved & ((wide.disagreement > 1.0 - alike) | (printed & (wide.slope < alike)))
        for alike in (MAJORITY, MAJORITY / 2)
    )
    other = both & (field > 1.0)
    contradicted = _connected(other_print | other, _sizable(surely | other, MIN_MM2))
    unlike_light = (tint > MAJORITY) | (step > MAJORITY * COLOUR_LIMIT)  # as a contact shadow is
    differs = contradicted | (narrow.disagreement > MAJORITY) | unlike_light
    agrees = wide.difference < MAJORITY / 2 * (wide.scanned + wide.seen)
    return Agreement(contradicted, resolved & printed & agrees & ~differs)


@dataclass(frozen=True, eq=False)
class Contrasts:
    """Local contrasts, each relative to the local mean: (h, w) mean squares and slope.

    difference  of the photograph's from the scan's.
    scanned, seen  of the scan's and of the photograph's.
    slope       of the photograph's on the scan's.
    """

    difference: Floats
    scanned: Floats
    seen: Floats
    slope: Floats

    @property
    def disagreement(self) -> Floats:
        """Return 0 where contrasts are equal and 1 where they are independent, (h, w).

        Creases explain some of the difference.
        """
        return np.asarray(self.difference / (self.scanned + self.seen + CONTRAST_FLOOR**2))


def _contrasts(photograph: Floats, scan: Floats, both: Mask, width_mm: float) -> Contrasts:
    """Return the contrasts of two pictures (h, w) within windows.

    width_mm: standard deviation of a window.
    """
    ours, theirs = (
        light / np.maximum(_local(light, both, width_mm), SINGLE_TINY) - 1.0 for light in (scan, photograph)
    )
    scanned, seen, product, difference = (
        _local(values, both, width_mm) for values in (ours**2, theirs**2, ours * theirs, (theirs - ours) ** 2)
    )
    return Contrasts(difference, scanned, seen, product / (scanned + SINGLE_TINY))


def _local(values: Floats, both: Mask, width_mm: float) -> Floats:
    """Return the local means (h, w) of values over a mask."""
    sigma = width_mm / COARSE_MM
    weight = np.maximum(_blur(both.astype(float), sigma), SINGLE_TINY)
    return np.asarray(_blur(np.where(both, values, 0.0), sigma) / weight)


def _log_gains(photograph: Floats, scan: Floats, both: Mask) -> Floats:
    """Return the logarithm of the photograph's gain over the scan near each place, (h, w, 3)."""
    sigma = BLEND_MM / COARSE_MM
    mask = both[..., None].astype(float)
    given, wanted = (_blur(light * mask, sigma) + DARK * _white(light, both) for light in (scan, photograph))
    return np.asarray(np.log(np.maximum(wanted, SINGLE_TINY) / np.maximum(given, SINGLE_TINY)))


def fitted_gains(photograph: Floats, scan: Floats, normals: Floats, both: Mask) -> Floats:
    """Return the log gain (h, w, 3) that lamps give to a photograph over the scan."""
    gains, terms = _log_gains(photograph, scan, both), _light_terms(normals, both)
    return np.stack([_fitted(gain, terms, both) for gain in np.moveaxis(gains, -1, 0)], axis=-1)


def _white(light: Floats, both: Mask) -> Floats:
    """Return the light (3,) of paper."""
    return np.asarray(np.quantile(light[both], 0.9, axis=0))


def _saturation(scan: Floats, both: Mask) -> Floats:
    """Return the saturation (h, w) of the print, as a logarithm.

    It is how far its colour departs from that of paper.
    """
    mask = both[..., None].astype(float)
    white = _white(scan, both)
    log_ratio = np.log((_blur(scan * mask, BLEND_MM / COARSE_MM) / np.maximum(white, SINGLE_TINY)) + DARK)
    return np.asarray(np.abs(log_ratio - log_ratio.mean(axis=2, keepdims=True)).max(axis=2))


def _light_terms(normals: Floats, both: Mask) -> Floats:
    """Return the light's terms (h, w, 10): 1, place, slopes of the normal, and all squares."""
    rows, cols = (np.linspace(-1.0, 1.0, size) for size in both.shape)
    y, x = np.meshgrid(rows, cols, indexing="ij")
    usual = np.median(normals[both], axis=0)
    u, v = np.moveaxis(np.nan_to_num(normals[..., :2] - usual[:2]), -1, 0)
    return np.stack([np.ones_like(x), x, y, x * y, x * x, y * y, u, v, u * u, v * v], axis=-1)


def _fitted(values: Floats, terms: Floats, both: Mask) -> Floats:
    """Return the combination of terms that most values follow, (h, w), by reweighting.

    values: (h, w).
    terms: (h, w, k).
    """
    some = np.flatnonzero(both)
    some = some[:: max(1, len(some) // SAMPLED)]
    sampled, wanted = terms.reshape(-1, terms.shape[-1])[some], values.ravel()[some]
    fit = np.zeros(terms.shape[-1])
    fit[0] = np.median(wanted)
    for _ in range(FITS):
        error = wanted - sampled @ fit
        scale = MAD_TO_SIGMA * np.median(np.abs(error)) + SINGLE_TINY
        weight = 1.0 / (1.0 + (error / (2.0 * scale)) ** 2)
        weighted = sampled * weight[:, None] ** 2
        # By the normal equations: ten unknowns, which a singular value decomposition of all rows takes ten times longer
        # to find. Of a flat page the slopes are all zero, and the equations singular.
        fit = np.linalg.lstsq(sampled.T @ weighted, weighted.T @ wanted, rcond=None)[0]
    # A normal unlike those of the page, at the end of a crease, is lit as no place that the fit follows is.
    followed = wanted[weight > MAJORITY]
    return np.clip(terms @ fit, followed.min(), followed.max())


def _unconfirmed_parts(contradicted: Mask, confirmed: Mask, both: Mask) -> Mask:
    """Return the parts (h, w) that are cut off and not confirmed.

    Contradictions cut them off from the page.
    """
    if not contradicted.any():
        return np.zeros_like(both)
    parts, count = label(both & ~contradicted)
    area = np.bincount(parts[confirmed], minlength=count + 1) * COARSE_MM**2
    poor = area < 2 * np.pi * WINDOW_MM**2  # of a window: less agrees by chance
    poor[0] = False
    return np.asarray(poor[parts])


def _grown(mask: Mask, radius_mm: float) -> Mask:
    """Dilate a mask by a radius, (h, w)."""
    return np.asarray(distance_transform_edt(~mask) * COARSE_MM <= radius_mm)


def _opened(mask: Mask, radius_mm: float) -> Mask:
    """Open a mask by a disc of a radius, (h, w)."""
    inner = distance_transform_edt(np.pad(mask, 1))[1:-1, 1:-1] * COARSE_MM > radius_mm
    return _grown(inner, radius_mm) if inner.any() else inner


def _connected(mask: Mask, seeds: Mask) -> Mask:
    """Return the connected pieces of a mask that hold a seed, (h, w)."""
    pieces, count = label(mask | seeds, np.ones((3, 3)))
    held = np.zeros(count + 1, bool)
    held[pieces[seeds]] = True
    return np.asarray(held[pieces])


def _sizable(mask: Mask, least_mm2: float) -> Mask:
    """Return the connected pieces of a mask of `least_mm2` or more, (h, w)."""
    pieces, count = label(mask, np.ones((3, 3)))
    large = np.bincount(pieces.ravel(), minlength=count + 1) * COARSE_MM**2 >= least_mm2
    large[0] = False
    return np.asarray(large[pieces])


def _blur(values: Floats, sigma: float) -> Floats:
    blurred: Floats = cv2.GaussianBlur(values, (0, 0), sigma)
    return blurred
