"""Removes light and shadow from the page.

Known for bare paper: ink is masked, the bare paper's brightness is continued under it by a smooth surface, and the page
is divided by that surface (Zhang, Yip & Tan, "Removing shading distortions in camera-based document images", 2007).
Here the shape of the page first determines what light must have fallen on it, over creases and under figures too; the
smooth surface only takes the rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from restore.numerics.limits import SINGLE_TINY
from restore.numerics.robust import MAD_TO_SIGMA
from restore.numerics.srgb import LINEAR
from restore.report import LightReport
from restore.scan import Bytes, Floats, Mask
from restore.shading.certainty import CERTAIN
from restore.shading.channels import as_list, highest, lowest, scaled, total_of
from restore.shading.crease_residual import FARTHEST, LEAST, crease_light, hollows
from restore.shading.divide import Division
from restore.shading.estimate import DIMMEST, MIN_PAPER, CheckPlaces, estimate_again, estimate_light
from restore.shading.horizon_map import fill_nearest
from restore.shading.paper import LIGHT_DPI, paper_candidates
from restore.shading.print_contrast import loses_print
from restore.shading.regions import regions_of
from restore.shading.relief import Field, Relief
from restore.shading.residual import CONTRAST, Residual, residual_light
from restore.shading.steps import DISPLACED, Steps, find_steps, place_steps
from restore.shading.surroundings import places_of, surroundings_of

BRIGHT_PRINT = 0.04  # of the page: where more of it is brighter than the ground, the ground is not paper
MAX_GAIN = 8.0  # three stops: a deeper shadow holds no picture to bring back, only noise
UNCERTAIN = round(CERTAIN * DISPLACED)  # cells by which a crease or the edge of a shadow may be misplaced
BRIGHTEST = 1.3  # of the paper's light in one channel: printed on white, no ink gives back more
SPARED = 7  # every seventh cell suffices for their unevenness


@dataclass(frozen=True, eq=False)
class ShadingResult:
    """Page without its shading.

    image: (h, w, 3) uint8.
    report: JSON values.
    light: what was removed; None where each of several pictures had its own.
    """

    image: Bytes
    report: LightReport
    light: PageLight | None = None


@dataclass(frozen=True, eq=False)
class PageLight:
    """Light of a page, found once at LIGHT_DPI, removed at any resolution.

    report: JSON values.
    gain: (r, c, 3), factor on the cells of the page, with the steps of its light that are drawn sharper; both are None
        where the light is kept.
    """

    report: LightReport
    gain: Field | None = None
    steps: Steps | None = None

    def removed_from(self, image: Bytes, mask: Mask, dpi: float, top: int = 0) -> ShadingResult:
        """Return a page at `dpi` without this light.

        Pixels outside the mask do not change.
        image: (h, w, 3) uint8, its rows from `top` on.
        mask: (h, w).
        """
        even = image if self._division is None else self._division.divided(image, mask, LIGHT_DPI / dpi, top)
        return ShadingResult(even, self.report, self)

    @cached_property
    def _division(self) -> Division | None:
        return None if self.gain is None or self.steps is None else Division(self.gain, self.steps, MAX_GAIN)


def find_light(image: Bytes, mask: Mask, relief: Relief) -> PageLight:
    """Find the light of a page (h, w, 3) uint8 painted at LIGHT_DPI, as its relief is.

    mask (h, w): where the page is.
    Where the light cannot be determined reliably it is kept, and the report gives the reason.
    """
    # A cell at the edge of the page may have the colours of what lies next to it.
    inside = relief.inside & (cv2.erode(mask.view(np.uint8), np.ones((3, 3), np.uint8), borderValue=1) > 0)
    colour = np.asarray(cv2.LUT(image, LINEAR))
    if inside.sum() < MIN_PAPER:
        return _kept("the page is too small")
    regions = regions_of(colour, relief.normals, inside)
    checks = CheckPlaces.of(colour, regions, inside)
    if not len(checks.cells):
        return _kept("no part of the page is of one print, so that no gradient is certain to be the light's")
    candidates = np.flatnonzero(paper_candidates(colour, inside, relief.dpi))
    surroundings = surroundings_of(relief)
    places = places_of(relief, surroundings.horizon)
    found = estimate_light(as_list(colour), candidates, places, surroundings, regions, checks, inside)
    if found is None:
        return _kept("nothing within its regions of one print shows reliably that the light on it is uneven")
    if not found.certainty.sure:
        again = estimate_again(found, colour, relief.normals, candidates, places, surroundings, inside)
        found, checks = again or (found, checks)
    # From here on light is measured in the level light.
    relative = 1 / np.maximum(found.light.level, SINGLE_TINY)
    expected = np.maximum(scaled(found.values.reshape(colour.shape), relative), np.float32(1 / DIMMEST))
    steps, seen = find_steps(fill_nearest(expected, inside), inside), scaled(colour, relative)
    residual = residual_light(seen / steps.light, relief.normals, inside, relief.dpi)
    steps = place_steps(steps, total_of(seen / (residual.surface * residual.colour)), residual.ground)
    expected = np.maximum(steps.sharp, np.float32(1 / DIMMEST))
    openness = fill_nearest(places.openness.reshape(inside.shape), inside)
    stretch = 1 / np.clip(fill_nearest(relief.normals[..., 2], inside), np.float32(1 / FARTHEST), np.float32(1))
    surface = _corrected(seen, expected, residual, inside, openness, stretch)
    corrected = _better(as_list(surface), as_list(expected), checks, residual.ground.ravel())
    if not corrected:
        surface = expected
    gain = fill_nearest(np.clip(1 / np.maximum(surface, SINGLE_TINY), 1 / MAX_GAIN, MAX_GAIN), inside)
    if loses_print(colour, gain, inside):
        return _kept("print would lose contrast against its surroundings")
    report: LightReport = {
        "removed": True,
        "corrected": corrected,
        "regions_fraction": regions.fraction(inside),
        "lamps": len(found.light.lamps),
        "fitted_to": found.fitted_to,
        "variation": found.certainty.variation,
        "standard_error": found.certainty.error,
        **_evenness(colour, gain, residual.ground, inside),
    }
    return PageLight(report, gain, steps)


def _better(surface: Field, expected: Field, checks: CheckPlaces, ground: Mask) -> bool:
    """Return whether a light explains the regions better with its residual.

    And those away from the ground (cells,), which the residual was not fitted to, not reliably worse.
    expected: (cells, 3).
    """
    away = checks[~ground[checks.cells]]
    return checks.gain(surface, expected)[0] > 0 and not away.prefer(expected, surface)


def _kept(reason: str) -> PageLight:
    """The light as it is, and why."""
    return PageLight({"removed": False, "reason": reason})


def _corrected(
    seen: Field, expected: Field, residual: Residual, inside: Mask, openness: Field, stretch: Field
) -> Field:
    """Return the light with its residual, and along creases.

    The creases count where the ground is paper.
    openness: (r, c), fraction of the room in sight.
    stretch: (r, c), cells of the page to one seen from above.
    Returns (r, c, 3).
    """
    surface = expected * residual.surface
    ratio = seen / (surface * residual.colour)
    if (lowest(ratio) > 1 + CONTRAST)[inside].mean() > BRIGHT_PRINT:
        return surface
    step = total_of(expected)
    excess = _excess_light(ratio, inside)
    reflectance = np.asarray(ratio / excess[..., None], dtype=np.float32)
    line = np.multiply(excess, crease_light(lowest(reflectance), highest(reflectance), step, inside, openness, stretch))
    # A step of the light is known to UNCERTAIN cells: what is left there is light from one of its sides.
    around = np.ones((2 * UNCERTAIN + 1, 2 * UNCERTAIN + 1), np.uint8)
    low, high = cv2.erode(step, around) / step, cv2.dilate(step, around) / step
    line = np.clip(line, np.where(hollows(openness), LEAST, low), high)
    return np.asarray(surface * line[..., None])


def _excess_light(ratio: Field, inside: Mask) -> Field:
    """Return by what factor the light must exceed the fitted light.

    No ink is brighter than paper in all channels, and none much brighter in one: what seems to be lies next to a crease
    or a shadow that is not quite where it was assumed. Returns (r, c), 1 almost everywhere.
    """
    above = np.maximum(lowest(ratio) / (1 + CONTRAST / 2), highest(ratio) / BRIGHTEST)
    above = np.where(inside, np.maximum(above, 1), 1).astype(np.float32)
    lifted: Field = cv2.GaussianBlur(cv2.dilate(above, np.ones((3, 3), np.uint8)), (0, 0), 1.0)
    return lifted


def _evenness(colour: Field, gain: Field, paper: Mask, inside: Mask) -> LightReport:
    some = np.flatnonzero(paper)[::SPARED]
    seen, gains = (as_list(field)[some] for field in (colour, gain))
    before, after = seen.mean(axis=1), (seen * gains).mean(axis=1)
    return {
        "paper_fraction": float(paper.sum() / max(inside.sum(), 1)),
        "unevenness_before": _unevenness(before),
        "unevenness": _unevenness(after),
        "illumination_gain": {"min": float(gain.min()), "max": float(gain.max())},
    }


def _unevenness(brightness: Floats) -> float:
    """Robust standard deviation over the mean of bare paper."""
    if not len(brightness):
        return 0.0
    centre = np.median(brightness)
    return float(MAD_TO_SIGMA * np.median(np.abs(brightness - centre)) / max(centre, SINGLE_TINY))
