"""The surface of a page once more, through its own points and through its edge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from restore.photogrammetry.boundary_gaps import SPACING_MM
from restore.photogrammetry.model import Model
from restore.photogrammetry.page import CardInView, PaperMasks, inside_polygon, without_card
from restore.photogrammetry.page_boundary import Edge, find_edge
from restore.photogrammetry.refined import Fitted, filled_again
from restore.photogrammetry.surfaces.folded import CREASE_MM, FoldedSurface, refold
from restore.photogrammetry.surfaces.page_surface import PageSurface
from restore.photogrammetry.surfaces.relief import Cloud, Relief, refine_relief
from restore.photogrammetry.surfaces.surface import fit_surface
from restore.scan import Floats, Ints

RIM_NOISE_MM = 0.1  # of the page's edge: a third of a pixel, and fibres
BRIDGE_NOISE_MM = 0.3  # of the edge between what is measured: a margin that is prolonged beyond a crease is off by more
CREASE_COUNT = 5  # ends of two lines of a ruled sheet, against the rows of print on the rest of each


def fit_to_edge(fitted: Fitted, model: Model, masks: PaperMasks, cards: Sequence[CardInView]) -> tuple[Fitted, Edge]:
    """Fit a surface again, to its points within the page's edge and the edge.

    A margin may be centimetres off until its edge is known, and beyond a crease a part of it is not found at first. So
    the edge is sought once more, near the surface that goes through the first.
    cards: what is known of the card in each view; no edge is sought there, and the copies are changed.
    Returns the surface and the edge.
    """
    edge = _edge_of(fitted, model, masks, cards, fitted.area.outline)
    fitted = _through(edge, fitted)
    if isinstance(fitted.surface, Relief):
        fitted = filled_again(fitted, fitted.surface, model, masks)
        outline = fitted.area.outline
    else:
        outline = fitted.surface.feet(edge.points, edge.places)
    edge = _edge_of(fitted, model, masks, cards, outline)
    return _through(edge, fitted), edge


def _within(edge: Edge, fitted: Fitted) -> Fitted:
    """Keep the points of a surface within the page's edge.

    As far as that is measured. Where a margin hangs down to the table, patches of the table are found next to it: a
    surface through them is torn down at its edge.
    """
    feet = fitted.surface.feet(fitted.points, fitted.feet)
    _, nearest = cKDTree(edge.places).query(feet)
    kept = inside_polygon(feet, edge.places) | ~edge.measured[nearest]
    return replace(fitted, points=fitted.points[kept], feet=feet[kept])


def _through(edge: Edge, fitted: Fitted) -> Fitted:
    """Fit a surface again to its points within the edge, and to the edge."""
    within = _within(edge, fitted)
    return replace(within, surface=_surface_through(edge, within))


def _surface_through(edge: Edge, fitted: Fitted) -> PageSurface:
    """The surface through its points and those of the edge."""
    surface, measured = fitted.surface, edge.measured
    if isinstance(surface, Relief):
        assert fitted.gaps is not None
        rim = Cloud.of(edge.points, edge.places, np.where(measured, RIM_NOISE_MM, BRIDGE_NOISE_MM), of_facets=False)
        return refine_relief(Cloud.of(fitted.points, fitted.feet).joined(fitted.gaps).joined(rim), surface)
    counted = measured * (_counts_at_creases(edge, surface) if isinstance(surface, FoldedSurface) else 1)
    points = np.concatenate([fitted.points, np.repeat(edge.points, counted, axis=0)])
    feet = np.concatenate([fitted.feet, np.repeat(edge.places, counted, axis=0)])
    if isinstance(surface, FoldedSurface):
        return refold(points, feet, surface)
    return fit_surface(points, feet, surface.smooth, stiffness=fitted.stiffness)[0]


def _counts_at_creases(edge: Edge, surface: FoldedSurface) -> Ints:
    """Return how often points of an edge count, (n,).

    Next to a crease, where nothing is printed, they alone show the paper.
    """
    label, _ = surface.located(edge.places)
    reach = round(CREASE_MM / SPACING_MM)
    near = ndimage.maximum_filter1d((label != np.roll(label, 1)).astype(int), 2 * reach + 1, mode="wrap")
    return np.where(near > 0, CREASE_COUNT, 1)


def _edge_of(fitted: Fitted, model: Model, masks: PaperMasks, cards: Sequence[CardInView], outline: Floats) -> Edge:
    """Find the edge of the page near an outline (n, 2) mm.

    It is sought where no card lies; the copies are changed there.
    """
    greys = fitted.greys
    ratio = greys.shape[2] / masks.size[0]
    for grey, paper, card in zip(greys, masks.masks, cards, strict=True):
        grey[:] = without_card(grey, paper, card.scaled(ratio).seen)
    return find_edge(masks, greys, model.cameras, fitted.surface, outline)
