"""The surface of a page and its cameras, out of photographs alone.

Cameras and a few thousand points come from features (`sparse`), scale and level from the card (`align`). Then, in
rounds of finer and finer patches: a smooth surface through the points (`surface`), patches of it found in all views
(`track`), cameras and points adjusted to them (`bundle`). The page ends where its edge is seen (`edges`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import cv2
import numpy as np

from restore.photo.camera import PhotoCamera
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
from restore.photogrammetry.align import Similarity, fit_similarity, triangulate_markers, upright
from restore.photogrammetry.bundle import Tracks, adjust
from restore.photogrammetry.card import SCALE_CARD, ScaleCard, outline_in
from restore.photogrammetry.edges import find_edge
from restore.photogrammetry.errors import NoPage, TooFewViews, ViewsApart
from restore.photogrammetry.mesh import mesh_within
from restore.photogrammetry.page import (
    PageArea,
    PaperMasks,
    area_of_votes,
    find_paper,
    ground_sample,
    on_page,
)
from restore.photogrammetry.sparse import LEAST_VIEWS, Progress, SparseModel, check_one_lens, reconstruct
from restore.photogrammetry.surface import HeightField, choose_stiffness, fit_surface
from restore.photogrammetry.track import HALF, Patches, Picture, track
from restore.scan import Floats, SurfaceMesh

LEAST_MARKERS = 4  # of the card: a plane and a scale, and one to spare
ARM_MM = 400.0  # from the camera to the page, where nothing tells the scale
LEAST_POINTS = 200  # on the page: as few features has a page with a line of print
MARGIN_MM = 30.0  # round the points, in which the page may go on without print
FIRST_STIFFNESS = 100.0  # mm²: of the surface through features, which are a quarter of a millimetre off
ROUND_STIFFNESS = 1.0  # mm²: between the rounds, where the surface only has to lie within the reach of the next
SMOOTHING_PX = 0.6  # standard deviation: a camera's pixels alias more than that
EDGE_CLEAR_MM = 1.0  # of the middle of a patch from the edge of the page, beyond half its side
LEAST_SIMILAR = 0.75  # correlation of a patch: text on the page to a shadow's edge has less
MOST_SIGMA_PX = 0.5  # standard deviation of a shift on the surface, in pixels of the ground
MOST_UNCOVERED = 0.01  # of the paper in the photographs, beyond the rim of the page
LEAST_EDGE = 0.9  # of the page's edge, that is measured: the rest is prolonged from the print
OUTLIER_SIGMAS = 3.0  # reprojection error of a point, over that of most, beyond which it is left out


def _silent(_stage: str, _done: float) -> None:
    """Progress that nobody watches."""


@dataclass(frozen=True)
class Round:
    """A round of patches: their samples and spacing in pixels of the ground."""

    sample: float
    spacing: float


ROUNDS = (Round(2.5, 40.0), Round(1.3, 24.0), Round(1.0, 14.0))


@dataclass(frozen=True, eq=False)
class PhotographedPage:
    """A page reconstructed from photographs.

    mesh         its surface over the table, z up, with the photograph that faces it most as its texture.
    photographs  those that joined, with their cameras in the frame of the mesh.
    report       what was found, in plain values.
    warnings     sentences.
    """

    mesh: SurfaceMesh
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
    mesh = replace(page.mesh, vertices=larger.points(page.mesh.vertices))
    return PhotographedPage(mesh, photographs, {**page.report, "scale": dict(source)})


@dataclass
class _Model:
    """The state of a reconstruction: views by index of the photograph, their cameras, and points (n, 3) mm."""

    views: list[int]
    cameras: list[PhotoCamera]
    points: Floats
    markers: Mapping[int, Mapping[int, Floats]]
    card: ScaleCard | None
    scale: dict[str, Any] = field(default_factory=dict)

    def move(self, similarity: Similarity) -> None:
        """Change the frame."""
        self.cameras = [similarity.camera(camera) for camera in self.cameras]
        self.points = similarity.points(self.points)


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
    model = _Model(views, list(sparse.cameras.values()), sparse.points, {} if card is None else markers, card)
    _set_frame(model, model.points)
    masks = _masks(photographs, model, markers)
    points = model.points[on_page(masks, model.cameras, model.points)]
    if len(points) < LEAST_POINTS:
        raise NoPage(
            f"only {len(points)} points of the photographs lie on a page",
            "lay the page on a table that is darker than paper or coloured, with the whole of it in every photograph",
        )
    if model.scale["from"] == "none":
        model.points = points
        _set_frame(model, points)
        points = model.points
    page = _dense(photographs, sparse.failed, model, masks, points, progress)
    if card is None:
        return page
    seen = {row: markers[view] for row, view in enumerate(views)}
    return replace(page, warnings=page.warnings + card_doubts(page.photographs, seen, page.report["scale"]))


def _masks(photographs: Sequence[Photograph], model: _Model, markers: Mapping[int, Mapping[int, Floats]]) -> PaperMasks:
    """Where paper is in the photographs of a model, the card left out where markers of it are seen."""
    outlines = [outline_in(markers[view]) for view in model.views]
    return find_paper([photographs[view].image for view in model.views], outlines)


def _set_frame(model: _Model, points: Floats) -> None:
    """Bring a model into millimetres over the table, its middle at the origin and up as in the first view."""
    up = -model.cameras[0].rotation[1]
    found = triangulate_markers(dict(zip(model.views, model.cameras, strict=True)), model.markers, LEAST_VIEWS)
    if model.card is not None and len(found) >= LEAST_MARKERS:
        numbers = list(found)
        known = np.column_stack([model.card.centres[numbers], np.zeros(len(numbers))])
        to_card = fit_similarity(np.array([found[number] for number in numbers]), known)
        off = to_card.points(np.array([found[number] for number in numbers])) - known
        level = upright(np.array([0.0, 0.0, 1.0]), to_card.rotation @ up)
        model.move(Similarity(to_card.scale, level @ to_card.rotation, level @ to_card.shift))
        model.scale = {
            "from": "card",
            "markers": len(found),
            "residual_mm": float(np.sqrt((off**2).sum(axis=1).mean())),
            "axes": level[:2, :2].tolist(),
            "middle": [0.0, 0.0, 0.0],
        }
        return
    middle = np.median(points, axis=0)
    positions = np.array([camera.position for camera in model.cameras])
    _, _, principal = np.linalg.svd(points - middle, full_matrices=False)
    normal = principal[2] * (np.sign(principal[2] @ (positions.mean(axis=0) - middle)) or 1.0)
    axes = upright(normal, up)
    scale = ARM_MM / float(np.median(np.linalg.norm(positions - middle, axis=1)))
    model.move(Similarity(scale, axes, -scale * axes @ middle))
    model.scale = {"from": "none"}


def _dense(
    photographs: Sequence[Photograph],
    failed: Mapping[int, str],
    model: _Model,
    masks: PaperMasks,
    points: Floats,
    progress: Progress,
) -> PhotographedPage:
    greys = _greys([photographs[view] for view in model.views])
    low, high = _bounds(points)
    surface = fit_surface(points, low, high, stiffness=FIRST_STIFFNESS)
    area = area_of_votes(masks, model.cameras, surface, low, high)
    history = []
    for number, plan in enumerate(ROUNDS):
        progress("surface", number / len(ROUNDS))
        points, facts = _round(greys, model, surface, area, plan)
        history.append(facts)
        low, high = _bounds(np.concatenate([points[:, :2], area.outline]))
        stiffness = choose_stiffness(points, low, high) if plan is ROUNDS[-1] else ROUND_STIFFNESS
        surface = fit_surface(points, low, high, stiffness=stiffness)
        area = area_of_votes(masks, model.cameras, surface, low, high)
    progress("surface", 1.0)
    progress("edge", 0.0)
    edge = find_edge(greys, model.cameras, surface, area.outline)
    share = float(edge.measured.mean())
    both = np.concatenate([points, edge.points[edge.measured]])
    surface = fit_surface(both, *_bounds(np.concatenate([both[:, :2], area.outline])), stiffness=stiffness)
    progress("edge", 1.0)
    mesh = _mesh(surface, edge.points[:, :2], photographs, model)
    kept = tuple(
        replace(photographs[view], camera=camera) for view, camera in zip(model.views, model.cameras, strict=True)
    )
    names = {photographs[k].name: why for k, why in failed.items()}
    uncovered = masks.uncovered(model.cameras, mesh.vertices, mesh.faces)
    report = {
        "views": [photographs[view].name for view in model.views],
        "left_out": names,
        "scale": {key: value for key, value in model.scale.items() if key not in ("axes", "middle")},
        "points": len(points),
        "edge_measured": share,
        "uncovered_paper": uncovered,
        "stiffness_mm2": stiffness,
        "rounds": history,
    }
    return PhotographedPage(mesh, kept, report, _warnings(names, model, uncovered, share))


def _warnings(left_out: Mapping[str, str], model: _Model, uncovered: float, edge: float) -> tuple[str, ...]:
    sentences = [f"{name} is left out: {why}" for name, why in left_out.items()]
    if model.scale["from"] == "none":
        sentences.append("the scale is not known: all sizes, and the dpi of the page with them, are guesses")
    if edge < LEAST_EDGE:
        sentences.append(
            f"only {edge:.0%} of the page's edge is found in the photographs: the rest is prolonged from the print, "
            "and the page's size is not to be trusted; photograph steep sides from beside them, too"
        )
    if uncovered > MOST_UNCOVERED:
        sentences.append(
            f"{uncovered:.0%} of the paper in the photographs is not on the restored page: its sides are too steep for "
            "these views, or another sheet lies beside it"
        )
    return tuple(sentences)


def _greys(photographs: Sequence[Photograph]) -> Picture:
    """(v, h, w) float32 brightness, a little smoothed."""
    greys = [cv2.cvtColor(photograph.image, cv2.COLOR_RGB2GRAY).astype(np.float32) for photograph in photographs]
    return np.stack([cv2.GaussianBlur(grey, (0, 0), SMOOTHING_PX) for grey in greys])


def _bounds(points: Floats) -> tuple[Floats, Floats]:
    """The rectangle, (2,) and (2,) mm, round points (n, 2 or 3) with a margin."""
    places = points[:, :2]
    return np.quantile(places, 0.002, axis=0) - MARGIN_MM, np.quantile(places, 0.998, axis=0) + MARGIN_MM


def _round(
    greys: Picture, model: _Model, surface: HeightField, area: PageArea, plan: Round
) -> tuple[Floats, dict[str, float]]:
    """Track patches of a surface, and adjust the model to them. Returns the points (n, 3) mm that agree."""
    low, high = area.bounds
    middle = np.array([[*(low + high) / 2, 0.0]])
    pixel = ground_sample(model.cameras, surface.points(middle[:, :2]))
    sample, spacing = plan.sample * pixel, plan.spacing * pixel
    grid = [np.arange(start, end, spacing) for start, end in zip(low, high, strict=True)]
    places = np.stack(np.meshgrid(*grid), axis=-1).reshape(-1, 2)
    places = places[area.contains(places, HALF * sample + EDGE_CLEAR_MM)]
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
    sigma = np.maximum(tracked.sigma_mm[view, used[at]] / pixel, 0.02)
    tracks = Tracks(view, at, tracked.pixels[view, used[at]], sigma)
    adjusted = adjust(model.cameras, patches.points[used], tracks)
    if plan is ROUNDS[0]:
        check_focal_lengths(adjusted, tracks, model.views)
    check_residuals(adjusted.residuals, sigma, view, model.views)
    error = np.linalg.norm(adjusted.residuals, axis=1)
    squared = np.bincount(at, error**2, len(used)) / np.bincount(at, minlength=len(used))
    rms = float(np.sqrt(np.median(squared)))
    model.cameras, model.points = adjusted.cameras, adjusted.points[np.sqrt(squared) < OUTLIER_SIGMAS * rms]
    _set_frame(model, model.points)
    facts = {"patches": len(places), "points": len(model.points), "reprojection_px": rms}
    return model.points, facts


def _mesh(surface: HeightField, outline: Floats, photographs: Sequence[Photograph], model: _Model) -> SurfaceMesh:
    """The mesh of a surface within an outline (n, 2) mm, seen in the photograph that faces it most."""
    vertices, faces = mesh_within(surface, outline)
    middle = vertices.mean(axis=0)
    ways = np.array([camera.position - middle for camera in model.cameras])
    best = int(np.argmax(ways[:, 2] / np.linalg.norm(ways, axis=1)))
    texture = photographs[model.views[best]].image
    provenance = {"device": "photographs", "unit": "mm", "unit_source": "given"}
    return SurfaceMesh(vertices, faces, model.cameras[best].project(vertices), texture, provenance)
