"""The surface of a page and its cameras, out of photographs alone.

Cameras and a few thousand points come from features (`sparse`), scale and level from the card (`align`). Then, in
rounds of finer and finer patches: a smooth surface through the points (`surface`), patches of it found in all views
(`track`), cameras and points adjusted to them (`bundle`). The page ends where its edge is seen (`edges`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from restore.camera.photo_camera import PhotoCamera
from restore.findings import NOTABLE, Finding
from restore.photo.orientation import turned_like
from restore.photo.photograph import Photograph
from restore.photogrammetry.cameras.agreement import card_findings, find_markers, with_blur, without
from restore.photogrammetry.cameras.align import MIN_VIEWS, Similarity
from restore.photogrammetry.cameras.card import SCALE_CARD, ScaleCard, outline_in
from restore.photogrammetry.cameras.sparse import Progress, SparseModel, check_one_lens, reconstruct
from restore.photogrammetry.errors import NoPage, TooFewViews, ViewsApart
from restore.photogrammetry.mesh import mesh_within, stretch
from restore.photogrammetry.model import Model
from restore.photogrammetry.page import CardInView, PaperMasks, find_paper, on_page
from restore.photogrammetry.page_boundary_fit import fit_to_edge
from restore.photogrammetry.refined import MISSED_FRACTION, missed, refined
from restore.photogrammetry.surfaces.page_surface import PageSurface
from restore.photogrammetry.surfaces.surface import STEP_MM
from restore.report import PhotogrammetryReport, ScaleReport
from restore.runtime.arguments import checks_types
from restore.scan import Floats, InterpolatedMesh
from restore.texture.coverage import distance_to

ENOUGH_VIEWS = 5  # of 1200 × 900: the pages of six triples in ten of them were 0.3 to 2 mm wrong, of one four in five
MIN_POINTS = 100  # on the page: as few features has a page with half a line of print
MIN_EDGE = 0.8  # of the page's edge, that is measured: a fifth is prolonged from the print to half a millimetre
MAX_OFF_MM = 0.25  # of such distances: five times that of a wave of 97 mm and 36°, the steepest that was tried
# Of the area: a page of four creases that was right had 0.004, as vertices near creases are moved onto them; a spread
# that was 0.5 % too large 0.011.
MAX_STRETCH = 0.006


def _silent(_stage: str, _done: float) -> None:
    """Progress that no one watches."""


@dataclass(frozen=True, eq=False)
class PhotographedPage:
    """Page reconstructed from photographs.

    mesh: its surface over the table, z up, with the photograph that faces it most as its texture. It counts as
        interpolated a knot of its spline and more from all points: there its stiffness alone determines its shape.
    photographs: those that joined, with their cameras in the frame of the mesh.
    report: what was found, in plain values.
    findings: what is to be reported of it.
    """

    mesh: InterpolatedMesh
    photographs: tuple[Photograph, ...]
    report: PhotogrammetryReport
    findings: tuple[Finding, ...] = ()

    def rescale_page(self, factor: float, source: ScaleReport) -> PhotographedPage:
        """The page made larger by a factor, as its scale was not known, without findings.

        source: what the factor was taken from, for the report.
        """
        larger = Similarity(factor, np.eye(3), np.zeros(3))
        photographs = tuple(
            replace(photograph, camera=photograph.camera and larger.camera(photograph.camera))
            for photograph in self.photographs
        )
        mesh = replace(
            self.mesh,
            vertices=larger.points(self.mesh.vertices),
            measured=larger.points(self.mesh.measured),
            reach_mm=factor * self.mesh.reach_mm,
        )
        return PhotographedPage(mesh, photographs, {**self.report, "scale_source": source})


@checks_types
def reconstruct_page(
    photographs: Sequence[Photograph], *, card: ScaleCard | None = SCALE_CARD, progress: Progress = _silent
) -> PhotographedPage:
    """Reconstruct the surface of a page on a table from photographs.

    The photographs are of one lens, from all round. `examples/photographs.py` makes a page of a folder of photographs.
    card: that lies next to the page, to take the scale from; it is needed in three of them. None for no scale.
    Returns the `mesh`, the `photographs` that joined, with their cameras, a `report` and `findings`; its method
    `rescale_page(factor, source)` gives it another size.
    Raises MixedLenses, Mirrored, TooFewViews, NoPage, CardApart, or ExtraMissing without pycolmap.
    """
    if len(photographs) < MIN_VIEWS:
        raise TooFewViews(
            f"{len(photographs)} photographs are too few: {MIN_VIEWS} are needed",
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
    """Return the page that the views of a sparse model show.

    markers: index of the photograph → those that it shows.
    Raises ViewsApart, naming views that do not show what the others show, or NoPage.
    """
    views = list(sparse.cameras)
    model = Model(views, list(sparse.cameras.values()), sparse.points, {} if card is None else markers, card)
    model.set_frame(model.points)
    cards = [_card_in(markers[view], camera, model.corners) for view, camera in zip(views, model.cameras, strict=True)]
    masks = find_paper([photographs[view].image for view in views], cards)
    points = model.points[on_page(masks, model.cameras, model.points)]
    if len(points) < MIN_POINTS:
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
    return replace(page, findings=page.findings + card_findings(page.photographs, seen, page.report["scale_source"]))


def _card_in(seen: Mapping[int, Floats], camera: PhotoCamera, corners: Floats | None) -> CardInView:
    """Return what is known of the card in a view.

    seen: pixels (2,) of the markers.
    corners: (4, 3) mm, if it was found.
    """
    whole = None if corners is None else camera.project(corners)
    return CardInView(outline_in(seen, margin_mm=0.0), outline_in(seen), whole, len(seen) == len(SCALE_CARD.centres))


def _dense(
    photographs: Sequence[Photograph],
    failed: Mapping[int, Finding],
    model: Model,
    masks: PaperMasks,
    cards: Sequence[CardInView],
    points: Floats,
    progress: Progress,
) -> PhotographedPage:
    fitted = refined([photographs[view] for view in model.views], model, masks, points, progress)
    progress("edge", 0.0)
    fitted, edge = fit_to_edge(fitted, model, masks, cards)
    surface = fitted.surface
    progress("edge", 1.0)
    between = () if fitted.gaps is None else (fitted.gaps.points,)
    measured = np.concatenate([fitted.points, *between, edge.points[edge.measured]])
    mesh, places = _mesh(surface, surface.feet(edge.points, edge.places), photographs, model, measured)
    kept = tuple(
        replace(photographs[view], camera=camera) for view, camera in zip(model.views, model.cameras, strict=True)
    )
    left_out = {photographs[k].name: why for k, why in failed.items()}
    report: PhotogrammetryReport = {
        "photographs_used": [photographs[view].name for view in model.views],
        "rejected": {name: why.text for name, why in left_out.items()},
        "scale_source": model.scale,
        "surface_points": len(fitted.points),
        "edge_measured_fraction": float(edge.measured.mean()),
        "paper_outside_fraction": masks.uncovered(model.cameras, mesh.vertices, mesh.faces),
        "interpolated_fraction": float((distance_to(mesh.measured, mesh.vertices) > mesh.reach_mm).mean()),
        "surface_residual_mm": missed(surface, fitted.points, fitted.feet),
        "excess_area_fraction": _excess(surface, mesh, places),
        "gutter_width_range_mm": _width_range(surface),
        **surface.described(fitted.stiffness),
        "adjustments": fitted.rounds,
    }
    return PhotographedPage(mesh, kept, report, _findings(report, left_out))


def _excess(surface: PageSurface, mesh: InterpolatedMesh, places: Floats) -> float | None:
    """Return the excess area of a mesh at places (n, 2) mm of a surface, None of facets."""
    corners = surface.flat_corners(mesh.vertices, mesh.faces, places)
    return None if corners is None else stretch(mesh.vertices, mesh.faces, corners)


def _width_range(surface: PageSurface) -> float | None:
    """Return how much the rows across a gutter differ in width, mm.

    Without a tenth at either end. None where no crease parts a surface in two.
    """
    widths = surface.gutter_widths()
    return None if widths is None else float(np.ptp(np.quantile(widths, [1 - MISSED_FRACTION, MISSED_FRACTION])))


def _findings(report: PhotogrammetryReport, left_out: Mapping[str, Finding]) -> tuple[Finding, ...]:
    """Return the findings about a page.

    report: as `PhotographedPage` has it.
    left_out: photograph's name → why.
    """
    found = [Finding.of("view_apart", name=name, reason=why.text) for name, why in left_out.items()]
    if len(report["photographs_used"]) < ENOUGH_VIEWS:
        found.append(Finding.of("few_views", count=len(report["photographs_used"]), enough=ENOUGH_VIEWS))
    if any(why.code in ("zoomed", "cropped") for why in left_out.values()):
        found.append(Finding.of("views_zoomed"))
    if report["scale_source"]["from"] == "none":
        found.append(Finding.of("no_scale"))
    if report["edge_measured_fraction"] < MIN_EDGE:
        found.append(Finding.of("edge_unseen", report["edge_measured_fraction"]))
    if report["surface_residual_mm"] > MAX_OFF_MM:
        found.append(Finding.of("surface_off", distance_mm=report["surface_residual_mm"]))
    if report["excess_area_fraction"] is not None and abs(report["excess_area_fraction"]) > MAX_STRETCH:
        found.append(Finding.of("area_gained", change=report["excess_area_fraction"]))
    if report["gutter_width_range_mm"] is not None and report["gutter_width_range_mm"] > MAX_OFF_MM:
        found.append(Finding.of("gutter_uneven", distance_mm=report["gutter_width_range_mm"]))
    if report["paper_outside_fraction"] > NOTABLE:
        found.append(Finding.of("paper_uncovered", report["paper_outside_fraction"]))
    return tuple(found)


def _mesh(
    surface: PageSurface, outline: Floats, photographs: Sequence[Photograph], model: Model, measured: Floats
) -> tuple[InterpolatedMesh, Floats]:
    """Mesh a surface within an outline (k, 2) mm.

    Its texture is the photograph that faces it most.
    measured: (k, 3) mm, the points that it was fitted to.
    Returns the mesh and the places (n, 2) mm.
    """
    vertices, faces, places = mesh_within(surface, outline)
    middle = vertices.mean(axis=0)
    ways = np.array([camera.position - middle for camera in model.cameras])
    best = int(np.argmax(ways[:, 2] / np.linalg.norm(ways, axis=1)))
    texture = photographs[model.views[best]].image
    provenance = {"device": "photographs", "unit": "mm", "unit_source": "given"}
    texcoords = model.cameras[best].project(vertices)
    return InterpolatedMesh(vertices, faces, texcoords, texture, provenance, measured, STEP_MM), places
