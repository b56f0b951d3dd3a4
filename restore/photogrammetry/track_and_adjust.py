"""One round: patches found again in all views, and an adjustment.

Cameras and points are adjusted to them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from restore.numerics.robust import SIGNIFICANT
from restore.photogrammetry.cameras.agreement import check_found, check_optics, check_residuals, within
from restore.photogrammetry.cameras.bundle import ROUGHLY, SETTLED, Tracks, adjust
from restore.photogrammetry.cameras.copies import Copies
from restore.photogrammetry.errors import NoPage
from restore.photogrammetry.model import Model
from restore.photogrammetry.page import MAJORITY, PageArea, PaperMasks, ground_sample
from restore.photogrammetry.surfaces.page_surface import PageSurface
from restore.photogrammetry.surfaces.surface import grid_places
from restore.photogrammetry.track import HALF, MIN_SIGMA_PX, MIN_SIMILAR, Patches, track
from restore.report import AdjustmentReport
from restore.scan import Floats

COARSE_SIDE = 1600  # pixels of a copy in which patches are as wide as the first surfaces are off, and more
FINE_SIDE = 2400  # pixels of a copy: finer ones of phones gain nothing, and cost memory
EDGE_CLEAR_MM = 1.0  # of the middle of a patch from the edge of the page, beyond half its side
MIN_PATCHES = 50  # found again: a quarter of the points on a page of few features
MAX_SIGMA_PX = 0.5  # standard deviation of a shift on the surface, in pixels of the copy
CREASED_SPACING = 0.7  # of that on smooth pages: a piece ends with its points, not at its creases
GROWTH_MM = 12.0  # beyond the area that is known: so far the surface is prolonged well enough to be found again

AnySurface = TypeVar("AnySurface", bound=PageSurface)


@dataclass(frozen=True)
class Round:
    """A round of patches.

    side     pixels of the longer side of the copies in which they are sought.
    sample   pixels of these copies to a sample.
    spacing  of the patches, in pixels of copies of COARSE_SIDE: finer photographs need no more patches.
    """

    side: int
    sample: float
    spacing: float


COARSE = Round(COARSE_SIDE, 2.5, 40.0)
ROUNDS = (COARSE, Round(COARSE_SIDE, 1.3, 24.0), Round(FINE_SIDE, 1.0, 14.0))
FACET_ROUNDS = (Round(FINE_SIDE, 0.6, 4.5), Round(FINE_SIDE, 0.8, 4.5), Round(FINE_SIDE, 0.8, 4.5))
LAST = ROUNDS[-1], FACET_ROUNDS[-1]


def _places_on(area: PageArea, sample: float, spacing: float, *, grows: bool) -> Floats:
    """Return places (n, 2) mm on the page for patches.

    Those of a page that grows are also beyond its edges.
    sample: mm, of a patch.
    """
    low, high = area.bounds
    beyond, clear = (GROWTH_MM, -GROWTH_MM) if grows else (0.0, HALF * sample + EDGE_CLEAR_MM)
    places = grid_places(low - beyond, high + beyond, spacing)
    return places[area.contains(places, clear)]


def play_round(
    greys: Copies, model: Model, surface: AnySurface, area: PageArea, plan: Round, masks: PaperMasks
) -> tuple[AnySurface, Floats, Floats, AdjustmentReport]:
    """Track patches of a surface, and adjust the model to them.

    Returns the surface in the frame of the adjusted model, the points (n, 3) mm that agree, and their feet (n, 2).
    """
    low, high = area.bounds
    size = model.cameras[0].size
    shrunk = size[0] / greys.shape[2]
    full_pixel = ground_sample(model.cameras, surface.points((low + high)[None] / 2))
    pixel = shrunk * full_pixel
    sample, spacing = plan.sample * pixel, plan.spacing * full_pixel * max(1.0, max(size) / COARSE_SIDE)
    spacing *= CREASED_SPACING if surface.piece_count > 1 else 1.0
    places = _places_on(area, sample, spacing, grows=plan is COARSE)
    places = places[surface.uncreased(places, HALF * sample)]
    patches = Patches(*surface.frames(places))
    tracked = track(greys, model.cameras, patches, sample)
    found = tracked.found(MIN_SIMILAR, MAX_SIGMA_PX * pixel)
    check_found(found, within(model.cameras, patches.points), model.views)
    used = np.flatnonzero(found.any(axis=0))
    if len(used) < MIN_PATCHES:
        raise NoPage(
            f"print is found again in the other photographs at {len(used)} places of the page only",
            "do not move the page between the photographs, and photograph it sharply; a blank page cannot be done",
        )
    view, at = np.nonzero(found[:, used])
    sigma = shrunk * np.maximum(tracked.sigma_mm[view, used[at]] / pixel, MIN_SIGMA_PX)
    tracks = Tracks(view, at, tracked.pixels[view, used[at]], sigma)
    with_card = model.with_markers(patches.points[used], tracks)
    adjusted = adjust(model.cameras, *with_card, settled=SETTLED if plan in LAST else ROUGHLY)
    if plan is COARSE:
        check_optics(adjusted, with_card[1], model.views)
    check_residuals(adjusted.residuals[: len(at)], sigma, view, model.views)
    error = np.linalg.norm(adjusted.residuals[: len(at)], axis=1)
    squared = np.bincount(at, error**2, len(used)) / np.bincount(at, minlength=len(used))
    rms = float(np.sqrt(np.median(squared)))
    agree = np.sqrt(squared) < SIGNIFICANT * rms
    if plan not in ROUNDS[1:]:  # a coarse patch may lie on the table, and any where a margin is not as it was prolonged
        fraction, _ = masks.votes(adjusted.cameras, adjusted.points[: len(used)], patches.normals[used], found[:, used])
        agree &= fraction > MAJORITY
    model.cameras, model.points = adjusted.cameras, adjusted.points[: len(used)][agree]
    surface = surface.moved(model.set_frame(model.points))
    feet = surface.feet(model.points, places[used[agree]])
    facts: AdjustmentReport = {"patches": len(places), "surface_points": len(model.points), "reprojection_px": rms}
    return surface, model.points, feet, facts
