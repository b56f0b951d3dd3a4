"""The surface of a page and its cameras, out of photographs alone.

Cameras and a few thousand points come from features (`sparse`), scale and level from the card (`align`). Then, in
rounds of finer and finer patches: a smooth surface through the points (`surface`), patches of it found in all views
(`track`), cameras and points adjusted to them (`bundle`). The page ends where its edge is seen (`edges`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from restore.photo.orientation import turned_like
from restore.photo.photograph import Photograph
from restore.photogrammetry.agreement import (
    card_doubts,
    check_focal_lengths,
    check_found,
    check_residuals,
    find_markers,
    with_blur,
    within,
    without,
)
from restore.photogrammetry.align import Similarity
from restore.photogrammetry.bundle import ROUGHLY, SETTLED, Tracks, adjust
from restore.photogrammetry.card import SCALE_CARD, ScaleCard, outline_in
from restore.photogrammetry.copies import Copies, smoothed_copies
from restore.photogrammetry.edges import Edge, find_edge
from restore.photogrammetry.errors import NoPage, TooFewViews, ViewsApart
from restore.photogrammetry.folded import FoldedSurface, PageSurface, fold, refold
from restore.photogrammetry.mesh import mesh_within, stretch
from restore.photogrammetry.model import Model
from restore.photogrammetry.page import (
    MAJORITY,
    PageArea,
    PaperMasks,
    area_of_votes,
    find_paper,
    ground_sample,
    on_page,
    without_card,
)
from restore.photogrammetry.sparse import LEAST_VIEWS, Progress, SparseModel, check_one_lens, reconstruct
from restore.photogrammetry.surface import (
    STEP_MM,
    Surface,
    choose_stiffness,
    fit_surface,
    grid_places,
)
from restore.photogrammetry.track import HALF, Patches, track
from restore.photogrammetry.unrolled import unrolled
from restore.scan import Floats, InterpolatedMesh
from restore.texture.coverage import distance_to

LEAST_POINTS = 200  # on the page: as few features has a page with a line of print
MARGIN_MM = 30.0  # round the points, in which the page may go on without print
EDGE_MARGIN_MM = 16.0  # round the page, once all of it is found: its edge is searched for 10 mm beyond
FIRST_STIFFNESS = 1e4  # mm⁴: of the surface through features: a wave of 97 mm and 36° is followed to half a millimetre
ROUND_SETTLED_MM = 0.02  # of the same surfaces: a tenth of a pixel
ROUND_STIFFNESS = 1e3  # mm⁴: between the rounds, where the surface only has to lie within the reach of the next
COARSE_SIDE = 1600  # pixels of a copy in which patches are as wide as the first surfaces are off, and more
FINE_SIDE = 2400  # pixels of a copy: finer ones of phones gain nothing, and cost memory
EDGE_CLEAR_MM = 1.0  # of the middle of a patch from the edge of the page, beyond half its side
LEAST_SIMILAR = 0.75  # correlation of a patch: text on the page to a shadow's edge has less
MOST_SIGMA_PX = 0.5  # standard deviation of a shift on the surface, in pixels of the copy
LEAST_SIGMA_PX = 0.02  # of the same: less is not to be had of interpolated pixels
MOST_UNCOVERED = 0.01  # of the paper in the photographs, beyond the rim of the page
LEAST_EDGE = 0.8  # of the page's edge, that is measured: a fifth is prolonged from the print to half a millimetre
MISSED_SHARE = 0.9  # of the measured points lie nearer to the surface than the distance that is reported
MOST_OFF_MM = 0.25  # of that distance: five times that of a wave of 97 mm and 36°, the steepest that was tried
# Of the area: a page of four creases that was right had 0.004, as vertices beside creases are moved onto them; a spread
# that was 0.5 % too large 0.011.
MOST_STRETCH = 0.006
OUTLIER_SIGMAS = 3.0  # reprojection error of a point, over that of most, beyond which it is left out


def _silent(_stage: str, _done: float) -> None:
    """Progress that nobody watches."""


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
CREASED_SPACING = 0.7  # of that on smooth pages: a piece is as large as its points tell, up to its creases
MOST_GROWTHS = 6  # coarse rounds: from a part of a roll to all of it
GROWN = 0.01  # of the page's area, that one more coarse round adds at least
GROWTH_MM = 12.0  # beyond the area that is known: so far the surface is prolonged well enough to be found again


@dataclass(frozen=True, eq=False)
class PhotographedPage:
    """A page reconstructed from photographs.

    mesh         its surface over the table, z up, with the photograph that faces it most as its texture. It counts as
                 interpolated a knot of its spline and more from all points: there its stiffness alone tells its shape.
    photographs  those that joined, with their cameras in the frame of the mesh.
    report       what was found, in plain values.
    warnings     sentences.
    """

    mesh: InterpolatedMesh
    photographs: tuple[Photograph, ...]
    report: Mapping[str, Any]
    warnings: tuple[str, ...] = ()


def rescaled(page: PhotographedPage, factor: float, source: Mapping[str, Any]) -> PhotographedPage:
    """A page whose scale was not known, made larger by a factor; source: what tells it, for the report."""
    larger = Similarity(factor, np.eye(3), np.zeros(3))
    photographs = tuple(
        replace(photograph, camera=photograph.camera and larger.camera(photograph.camera))
        for photograph in page.photographs
    )
    mesh = replace(
        page.mesh,
        vertices=larger.points(page.mesh.vertices),
        measured=larger.points(page.mesh.measured),
        reach_mm=factor * page.mesh.reach_mm,
    )
    return PhotographedPage(mesh, photographs, {**page.report, "scale": dict(source)})


def reconstruct_page(
    photographs: Sequence[Photograph], *, card: ScaleCard | None = SCALE_CARD, progress: Progress = _silent
) -> PhotographedPage:
    """The surface of a page on a table, out of photographs of one lens from all round.

    card: that lies beside the page, to take the scale from; it is needed in three of them. None for no scale.
    Raises MixedLenses, Mirrored, TooFewViews, NoPage, CardApart, or ExtraMissing without pycolmap.
    """
    if len(photographs) < LEAST_VIEWS:
        raise TooFewViews(
            f"{len(photographs)} photographs are too few: {LEAST_VIEWS} are needed",
            "photograph the page from above and from all sides, 5 to 25 times",
        )
    photographs = [turned_like(photograph, photographs[0]) for photograph in photographs]
    check_one_lens(photographs)
    markers = find_markers(photographs, card or SCALE_CARD)
    sparse = reconstruct(photographs, progress)
    while True:
        try:
            return _page_of(photographs, sparse, markers, card, progress)
        except NoPage as fault:
            raise with_blur(fault, photographs) from None
        except ViewsApart as apart:
            names = [photograph.name for photograph in photographs]
            failed = without(sparse.failed, apart, len(sparse.cameras), names)
            cameras = {view: camera for view, camera in sparse.cameras.items() if view not in failed}
            sparse = replace(sparse, cameras=cameras, failed=failed)


def _page_of(
    photographs: Sequence[Photograph],
    sparse: SparseModel,
    markers: Mapping[int, Mapping[int, Floats]],
    card: ScaleCard | None,
    progress: Progress,
) -> PhotographedPage:
    """The page that the views of a sparse model show; markers: index of the photograph → those that it shows.

    Raises ViewsApart, naming views that do not show what the others show, or NoPage.
    """
    views = list(sparse.cameras)
    model = Model(views, list(sparse.cameras.values()), sparse.points, {} if card is None else markers, card)
    model.set_frame(model.points)
    cards = [outline_in(markers[view]) for view in views]  # cut out where markers of it are seen
    masks = find_paper([photographs[view].image for view in views], cards)
    points = model.points[on_page(masks, model.cameras, model.points)]
    if len(points) < LEAST_POINTS:
        raise NoPage(
            f"only {len(points)} points of the photographs lie on a page",
            "lay the page on a table that is darker than paper or coloured, with the whole of it in every photograph",
        )
    if model.scale["from"] == "none":
        model.points = points
        model.set_frame(points)
        points = model.points
    page = _dense(photographs, sparse.failed, model, masks, cards, points, progress)
    if card is None:
        return page
    seen = {row: markers[view] for row, view in enumerate(views)}
    return replace(page, warnings=page.warnings + card_doubts(page.photographs, seen, page.report["scale"]))


def _dense(
    photographs: Sequence[Photograph],
    failed: Mapping[int, str],
    model: Model,
    masks: PaperMasks,
    cards: Sequence[Floats | None],
    points: Floats,
    progress: Progress,
) -> PhotographedPage:
    fitted = _refined([photographs[view] for view in model.views], model, masks, points, progress)
    progress("edge", 0.0)
    edge = _edge_of(fitted, model, masks, cards)
    both = np.concatenate([fitted.points, edge.points[edge.measured]])
    start = np.concatenate([fitted.surface.feet(fitted.points, fitted.feet), edge.places[edge.measured]])
    if isinstance(fitted.surface, FoldedSurface):
        surface: PageSurface = refold(both, start, fitted.surface)
    else:
        surface, _ = fit_surface(both, start, fitted.surface, stiffness=fitted.stiffness)
    progress("edge", 1.0)
    mesh = _mesh(surface, surface.feet(edge.points, edge.places), photographs, model, both)
    kept = tuple(
        replace(photographs[view], camera=camera) for view, camera in zip(model.views, model.cameras, strict=True)
    )
    left_out = {photographs[k].name: why for k, why in failed.items()}
    off = np.linalg.norm(fitted.points - surface.points(surface.feet(fitted.points, fitted.feet)), axis=1)
    report = {
        "views": [photographs[view].name for view in model.views],
        "left_out": left_out,
        "scale": dict(model.scale),
        "points": len(fitted.points),
        "edge_measured": float(edge.measured.mean()),
        "uncovered_paper": masks.uncovered(model.cameras, mesh.vertices, mesh.faces),
        "interpolated": float((distance_to(mesh.measured, mesh.vertices) > mesh.reach_mm).mean()),
        "surface_off_mm": float(np.quantile(off, MISSED_SHARE)),
        "stretch": stretch(mesh.vertices, mesh.faces),
        "stiffness_mm4": surface.paper.stiffness if isinstance(surface, FoldedSurface) else fitted.stiffness,
        "pieces": len(surface.pieces) if isinstance(surface, FoldedSurface) else 1,
        "rounds": fitted.rounds,
    }
    return PhotographedPage(mesh, kept, report, _warnings(report))


@dataclass(frozen=True, eq=False)
class _Fitted:
    """A surface through points (n, 3) mm with feet (n, 2) mm, of a stiffness in mm⁴ where it is smooth.

    area    of the page on it. greys: the copies in which the points were tracked last.
    rounds  what each round found.
    """

    surface: PageSurface
    points: Floats
    feet: Floats
    stiffness: float
    area: PageArea
    greys: Copies
    rounds: list[dict[str, float]]


def _refined(
    joined: Sequence[Photograph], model: Model, masks: PaperMasks, points: Floats, progress: Progress
) -> _Fitted:
    """The surface after all rounds, begun with points (n, 3) mm that features gave; the model is adjusted to each."""
    greys = smoothed_copies(joined, COARSE_SIDE)
    surface: PageSurface
    surface, area = _first_surface(model, masks, points)
    rounds: list[dict[str, float]] = []
    plans, before, last = [COARSE] * MOST_GROWTHS + list(ROUNDS[1:]), 0, COARSE
    while plans:
        plan = plans.pop(0)
        progress("surface", len(rounds) / (len(rounds) + len(plans) + 1))
        if plan.side != COARSE_SIDE:
            greys = smoothed_copies(joined, plan.side)
        surface, points, feet, facts = _round(greys, model, surface, area, plan, masks)
        rounds.append(facts)
        margin = MARGIN_MM if COARSE in plans else EDGE_MARGIN_MM
        smooth = surface.smooth.within(*_bounds(np.concatenate([feet, area.outline]), margin))
        stiffness = ROUND_STIFFNESS
        smooth, feet = fit_surface(points, feet, smooth, stiffness=stiffness, settled=ROUND_SETTLED_MM)
        surface = smooth if plan is COARSE else fold(points, feet, smooth)
        if isinstance(surface, FoldedSurface) and plan is not last:
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
    progress("surface", 1.0)
    return _Fitted(surface, points, feet, stiffness, area, greys, rounds)


def _edge_of(fitted: _Fitted, model: Model, masks: PaperMasks, cards: Sequence[Floats | None]) -> Edge:
    """The edge of the page, sought where no card lies; the copies are changed there."""
    greys = fitted.greys
    ratio = greys.shape[2] / masks.size[0]
    for grey, paper, card in zip(greys, masks.masks, cards, strict=True):
        grey[:] = without_card(grey, paper, None if card is None else (card + 0.5) * ratio - 0.5)
    return find_edge(greys, model.cameras, fitted.surface, fitted.area.outline)


def _first_surface(model: Model, masks: PaperMasks, points: Floats) -> tuple[Surface, PageArea]:
    """The surface through points (n, 3) mm that features gave, over the flat page, and the page's area there."""
    low, high = _bounds(points[:, :2], MARGIN_MM)
    level = Surface.level(low, high, float(np.median(points[:, 2])))
    raised, _ = fit_surface(points, points[:, :2], level, stiffness=FIRST_STIFFNESS, inextensible=False)
    surface = unrolled(raised, area_of_votes(masks, model.cameras, raised, low, high), MARGIN_MM)
    surface, _ = fit_surface(points, surface.nearest(points), surface, stiffness=FIRST_STIFFNESS)
    return surface, area_of_votes(masks, model.cameras, surface, *surface.bounds)


def _warnings(report: Mapping[str, Any]) -> tuple[str, ...]:
    """What of a report, as `PhotographedPage` has it, is to be doubted."""
    sentences = [f"{name} is left out: {why}" for name, why in report["left_out"].items()]
    if report["scale"]["from"] == "none":
        sentences.append("the scale is not known: all sizes, and the dpi of the page with them, are guesses")
    if report["edge_measured"] < LEAST_EDGE:
        sentences.append(
            f"only {report['edge_measured']:.0%} of the page's edge is found in the photographs: the rest is prolonged "
            "from the print, and the page's size is not to be trusted; photograph steep sides from beside them, too"
        )
    if report["surface_off_mm"] > MOST_OFF_MM:
        sentences.append(
            f"the surface passes one in ten of the measured points {report['surface_off_mm']:.1f} mm and more away: "
            "the page is creased, or its shape was not found, and the result is not to be trusted"
        )
    if abs(report["stretch"]) > MOST_STRETCH:
        sentences.append(
            f"the surface has {report['stretch']:+.1%} of area that paper cannot have: it is torn or doubled beside a "
            "crease, and the page's size is not to be trusted; photograph the creases from both sides"
        )
    if report["uncovered_paper"] > MOST_UNCOVERED:
        sentences.append(
            f"{report['uncovered_paper']:.0%} of the paper in the photographs is not on the restored page: its sides "
            "are too steep for these views, or another sheet lies beside it"
        )
    return tuple(sentences)


def _bounds(places: Floats, margin: float) -> tuple[Floats, Floats]:
    """The rectangle, (2,) and (2,) mm, round places (n, 2) with a margin."""
    return np.quantile(places, 0.002, axis=0) - margin, np.quantile(places, 0.998, axis=0) + margin


def _round(
    greys: Copies, model: Model, surface: PageSurface, area: PageArea, plan: Round, masks: PaperMasks
) -> tuple[PageSurface, Floats, Floats, dict[str, float]]:
    """Track patches of a surface, and adjust the model to them.

    Returns the surface in the frame of the adjusted model, the points (n, 3) mm that agree, and their feet (n, 2).
    """
    low, high = area.bounds
    size = model.cameras[0].size
    shrunk = size[0] / greys.shape[2]
    full_pixel = ground_sample(model.cameras, surface.points((low + high)[None] / 2))
    pixel = shrunk * full_pixel
    sample, spacing = plan.sample * pixel, plan.spacing * full_pixel * max(1.0, max(size) / COARSE_SIDE)
    spacing *= CREASED_SPACING if isinstance(surface, FoldedSurface) else 1.0
    if plan is COARSE:
        places = grid_places(low - GROWTH_MM, high + GROWTH_MM, spacing)
        places = places[area.contains(places, -GROWTH_MM)]
    else:
        places = grid_places(low, high, spacing)
        places = places[area.contains(places, HALF * sample + EDGE_CLEAR_MM)]
    places = places[surface.uncreased(places, HALF * sample)]
    patches = Patches(*surface.frames(places))
    tracked = track(greys, model.cameras, patches, sample)
    found = tracked.found(LEAST_SIMILAR, MOST_SIGMA_PX * pixel)
    check_found(found, within(model.cameras, patches.points), model.views)
    used = np.flatnonzero(found.any(axis=0))
    if len(used) < LEAST_POINTS // 4:
        raise NoPage(
            f"print is found again in the other photographs at {len(used)} places of the page only",
            "do not move the page between the photographs, and photograph it sharply; a blank page cannot be done",
        )
    view, at = np.nonzero(found[:, used])
    sigma = shrunk * np.maximum(tracked.sigma_mm[view, used[at]] / pixel, LEAST_SIGMA_PX)
    tracks = Tracks(view, at, tracked.pixels[view, used[at]], sigma)
    with_card = model.with_markers(patches.points[used], tracks)
    adjusted = adjust(model.cameras, *with_card, settled=SETTLED if plan is ROUNDS[-1] else ROUGHLY)
    if plan is COARSE:
        check_focal_lengths(adjusted, with_card[1], model.views)
    check_residuals(adjusted.residuals[: len(at)], sigma, view, model.views)
    error = np.linalg.norm(adjusted.residuals[: len(at)], axis=1)
    squared = np.bincount(at, error**2, len(used)) / np.bincount(at, minlength=len(used))
    rms = float(np.sqrt(np.median(squared)))
    agree = np.sqrt(squared) < OUTLIER_SIGMAS * rms
    if plan is COARSE:
        agree &= masks.votes(adjusted.cameras, adjusted.points[: len(used)], patches.normals[used])[0] > MAJORITY
    model.cameras, model.points = adjusted.cameras, adjusted.points[: len(used)][agree]
    surface = surface.moved(model.set_frame(model.points))
    feet = surface.feet(model.points, places[used[agree]])
    facts = {"patches": len(places), "points": len(model.points), "reprojection_px": rms}
    return surface, model.points, feet, facts


def _mesh(
    surface: PageSurface, outline: Floats, photographs: Sequence[Photograph], model: Model, measured: Floats
) -> InterpolatedMesh:
    """The mesh of a surface within an outline (n, 2) mm, seen in the photograph that faces it most.

    measured: the points (k, 3) mm that it was fitted to.
    """
    vertices, faces = mesh_within(surface, outline)
    middle = vertices.mean(axis=0)
    ways = np.array([camera.position - middle for camera in model.cameras])
    best = int(np.argmax(ways[:, 2] / np.linalg.norm(ways, axis=1)))
    texture = photographs[model.views[best]].image
    provenance = {"device": "photographs", "unit": "mm", "unit_source": "given"}
    texcoords = model.cameras[best].project(vertices)
    return InterpolatedMesh(vertices, faces, texcoords, texture, provenance, measured, STEP_MM)
