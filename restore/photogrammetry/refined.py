"""The surface of a page in ever finer rounds: smooth, of few pieces, or of many facets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from restore.photo.photograph import Photograph
from restore.photogrammetry.cameras.copies import Copies, smoothed_copies
from restore.photogrammetry.cameras.sparse import Progress
from restore.photogrammetry.gaps import fill_gaps
from restore.photogrammetry.model import Model
from restore.photogrammetry.page import PageArea, PaperMasks, area_of_votes
from restore.photogrammetry.page_boundary import find_rough_edge
from restore.photogrammetry.surfaces.folded import fold
from restore.photogrammetry.surfaces.lattice import Cloud
from restore.photogrammetry.surfaces.page_surface import PageSurface
from restore.photogrammetry.surfaces.relief import Relief, raise_relief
from restore.photogrammetry.surfaces.surface import Surface, choose_stiffness, fit_surface
from restore.photogrammetry.track_and_adjust import COARSE, COARSE_SIDE, FACET_ROUNDS, FINE_SIDE, ROUNDS, play_round
from restore.photogrammetry.unrolled import unrolled
from restore.report import AdjustmentReport
from restore.scan import Floats

MARGIN_MM = 30.0  # round the points, in which the page may go on without print
EDGE_MARGIN_MM = 16.0  # round the page, once all of it is found: its edge is searched for 10 mm beyond
FIRST_STIFFNESS = 1e4  # mm⁴: of the surface through features: a wave of 97 mm and 36° is followed to half a millimetre
ROUND_SETTLED_MM = 0.02  # of the same surfaces: a tenth of a pixel
ROUND_STIFFNESS = 1e3  # mm⁴: between the rounds, where the surface only has to lie within the reach of the next
MAX_GROWTHS = 6  # coarse rounds: from a part of a roll to all of it
GROWN = 0.01  # of the page's area, that one more coarse round adds at least
MAX_PIECES = 2  # of the pages of a spread: leaflets and maps have more, and print next to their folds
MISSED_FRACTION = 0.9  # of the measured points lie nearer to the surface than what it misses them by
ROUGH_MM = 0.3  # of an edge in masks, standard deviation: half a pixel of theirs
EXPLAINED = 0.5  # of that, by facets: of a creased page a tenth is left, of photographs that disagree most of it
CREASED_MM = 0.1  # missed by a smooth surface: three times that of a wave of 97 mm and 36°


@dataclass(frozen=True, eq=False)
class Fitted:
    """Surface through points (n, 3) mm with feet (n, 2) mm.

    stiffness: mm⁴, where it is smooth.
    area: of the page on it.
    greys: the copies in which the points were tracked last.
    rounds: what each round found.
    gaps: points between those: of a relief alone.
    """

    surface: PageSurface
    points: Floats
    feet: Floats
    stiffness: float
    area: PageArea
    greys: Copies
    rounds: list[AdjustmentReport]
    gaps: Cloud | None = None


def refined(
    joined: Sequence[Photograph], model: Model, masks: PaperMasks, points: Floats, progress: Progress
) -> Fitted:
    """Return the surface after all rounds.

    The model is adjusted to each.
    points: (n, 3) mm, that features gave.
    """
    fitted = _of_few_pieces(joined, model, masks, points, progress)
    if fitted.surface.piece_count > MAX_PIECES:
        fitted = _of_facets(joined, model, masks, fitted, progress)
    elif _missed(fitted) > CREASED_MM:
        before = replace(model)
        faceted = _of_facets(joined, model, masks, fitted, progress)
        if _missed(faceted) < EXPLAINED * _missed(fitted):
            fitted = faceted
        else:
            model.become(before)
    progress("surface", 1.0)
    return fitted


def _of_few_pieces(
    joined: Sequence[Photograph], model: Model, masks: PaperMasks, points: Floats, progress: Progress
) -> Fitted:
    """Return the smooth surface, or that of few pieces.

    It ends early where these are more than MAX_PIECES.
    """
    greys = smoothed_copies(joined, COARSE_SIDE)
    surface: PageSurface
    surface, area = _first_surface(model, masks, points)
    rounds: list[AdjustmentReport] = []
    plans, before, last = [COARSE] * MAX_GROWTHS + list(ROUNDS[1:]), 0, COARSE
    while plans:
        plan = plans.pop(0)
        progress("surface", len(rounds) / (len(rounds) + len(plans) + 1))
        if plan.side != COARSE_SIDE:
            greys = smoothed_copies(joined, plan.side)
        surface, points, feet, facts = play_round(greys, model, surface, area, plan, masks)
        rounds.append(facts)
        margin = MARGIN_MM if COARSE in plans else EDGE_MARGIN_MM
        smooth = surface.smooth.within(*_bounds(np.concatenate([feet, area.outline]), margin))
        stiffness = ROUND_STIFFNESS
        smooth, feet = fit_surface(points, feet, smooth, stiffness=stiffness, settled=ROUND_SETTLED_MM)
        surface = smooth if plan is COARSE else fold(points, feet, smooth)
        if surface.piece_count > MAX_PIECES:
            break
        if surface is not smooth and plan is not last:
            plans.insert(0, plan)  # again, now up to the creases
        elif surface is smooth and not plans:
            stiffness = choose_stiffness(points, feet, smooth)
            surface, feet = fit_surface(points, feet, smooth, stiffness=stiffness)
        last = plan
        area = area_of_votes(masks, model.cameras, surface, *surface.bounds)
        cells = int(area.cells.sum())
        if cells < (1.0 + GROWN) * before:
            plans = [one for one in plans if one is not COARSE]
        before = cells
    return Fitted(surface, points, feet, stiffness, area, greys, rounds)


def _missed(fitted: Fitted) -> float:
    return missed(fitted.surface, fitted.points, fitted.feet)


def missed(surface: PageSurface, points: Floats, feet: Floats) -> float:
    """Return the 90th percentile of a surface's distance from points, mm.

    points: (n, 3) mm, with feet (n, 2) mm on it.
    """
    off = np.linalg.norm(points - surface.points(surface.feet(points, feet)), axis=1)
    return float(np.quantile(off, MISSED_FRACTION))


def _of_facets(
    joined: Sequence[Photograph], model: Model, masks: PaperMasks, fitted: Fitted, progress: Progress
) -> Fitted:
    """The relief of many facets, begun with a smooth surface that rounds its creases."""
    greys = smoothed_copies(joined, FINE_SIDE)
    surface, rounds = raise_relief(fitted.points, fitted.feet, fitted.surface.smooth), list(fitted.rounds)
    for number, plan in enumerate(FACET_ROUNDS):
        progress("surface", (number + 1) / (len(FACET_ROUNDS) + 1))
        area = area_of_votes(masks, model.cameras, surface, *surface.bounds)
        surface, points, feet, facts = play_round(greys, model, surface, area, plan, masks)
        rounds.append(facts)
        tracked = Cloud.of(points, feet)
        if number == 0:  # so far it follows points of patches that were wider than facets are
            surface = surface.through(tracked.joined(_rim(model, masks, surface)))
        area = area_of_votes(masks, model.cameras, surface, *surface.bounds)
        gaps = fill_gaps(greys, model, surface, area, feet)
        surface = surface.through(tracked.joined(gaps).joined(_rim(model, masks, surface)))
    area = area_of_votes(masks, model.cameras, surface, *surface.bounds)
    return Fitted(surface, points, feet, fitted.stiffness, area, greys, rounds, gaps)


def filled_again(fitted: Fitted, model: Model, masks: PaperMasks) -> Fitted:
    """A relief that was fitted to more, its edge, and what is found in its gaps now."""
    area = area_of_votes(masks, model.cameras, fitted.surface, *fitted.surface.bounds)
    return replace(fitted, area=area, gaps=fill_gaps(fitted.greys, model, fitted.surface, area, fitted.feet))


def _rim(model: Model, masks: PaperMasks, surface: Relief) -> Cloud:
    """Return the page's edge as far as masks show it.

    Without it a margin beyond a crease is tilted as its neighbours are.
    """
    area = area_of_votes(masks, model.cameras, surface, *surface.bounds)
    edge = find_rough_edge(masks, model.cameras, surface, area.outline)
    return Cloud.of(edge.points[edge.measured], edge.places[edge.measured], ROUGH_MM, of_facets=False)


def _first_surface(model: Model, masks: PaperMasks, points: Floats) -> tuple[Surface, PageArea]:
    """Return the surface through points of features, and the page's area.

    The surface is over the flat page.
    points: (n, 3) mm.
    """
    low, high = _bounds(points[:, :2], MARGIN_MM)
    level = Surface.level(low, high, float(np.median(points[:, 2])))
    raised, _ = fit_surface(points, points[:, :2], level, stiffness=FIRST_STIFFNESS, inextensible=False)
    surface = unrolled(raised, area_of_votes(masks, model.cameras, raised, low, high), MARGIN_MM)
    surface, _ = fit_surface(points, surface.nearest(points), surface, stiffness=FIRST_STIFFNESS)
    return surface, area_of_votes(masks, model.cameras, surface, *surface.bounds)


def _bounds(places: Floats, margin: float) -> tuple[Floats, Floats]:
    """The rectangle, (2,) and (2,) mm, round places (n, 2) with a margin."""
    return np.quantile(places, 0.002, axis=0) - margin, np.quantile(places, 0.998, axis=0) + margin
