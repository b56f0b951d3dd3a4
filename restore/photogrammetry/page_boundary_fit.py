"""The surface of a page once more, through its own points and through its edge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from restore.numerics.polygons import inside_polygon
from restore.photogrammetry.boundary_gaps import SPACING_MM
from restore.photogrammetry.model import Model
from restore.photogrammetry.page import CardInView, PaperMasks, without_card
from restore.photogrammetry.page_boundary import Edge, find_edge
from restore.photogrammetry.refined import Fitted, filled_again
from restore.photogrammetry.surfaces.lattice import Cloud
from restore.scan import Floats

RIM_NOISE_MM = 0.1  # of the page's edge: a third of a pixel, and fibres
BRIDGE_NOISE_MM = 0.3  # of the edge between what is measured: a margin that is prolonged beyond a crease is off by more


def fit_to_edge(fitted: Fitted, model: Model, masks: PaperMasks, cards: Sequence[CardInView]) -> tuple[Fitted, Edge]:
    """Fit a surface again, to its points within the page's edge and the edge.

    A margin may be centimetres off until its edge is known, and beyond a crease a part of it is not found at first. So
    the edge is sought once more, near the surface that goes through the first.
    cards: what is known of the card in each view; no edge is sought there, and the copies are changed.
    Returns the surface and the edge.
    """
    edge = _edge_of(fitted, model, masks, cards, fitted.area.outline)
    fitted = _through(edge, fitted)
    if fitted.gaps is not None:
        fitted = filled_again(fitted, model, masks)
        outline = fitted.area.outline
    else:
        outline = fitted.surface.feet(edge.points, edge.places)
    edge = _edge_of(fitted, model, masks, cards, outline)
    return _through(edge, fitted), edge


def _within(edge: Edge, fitted: Fitted) -> Fitted:
    """Keep the points of a surface within the page's edge, as far as that is measured.

    Where a margin hangs down to the table, patches of the table are found next to it: a surface through them is torn
    down at its edge.
    """
    feet = fitted.surface.feet(fitted.points, fitted.feet)
    _, nearest = cKDTree(edge.places).query(feet)
    kept = inside_polygon(feet, edge.places) | ~edge.measured[nearest]
    return replace(fitted, points=fitted.points[kept], feet=feet[kept])


def _through(edge: Edge, fitted: Fitted) -> Fitted:
    """Fit a surface again to its points within the edge, and to the edge."""
    within = _within(edge, fitted)
    cloud = Cloud.of(within.points, within.feet)
    if within.gaps is not None:
        cloud = cloud.joined(within.gaps)
    counts = within.surface.edge_counts(edge.places, edge.measured, SPACING_MM)
    noise = np.where(edge.measured, RIM_NOISE_MM, BRIDGE_NOISE_MM)
    points, places, noise = (np.repeat(of, counts, axis=0) for of in (edge.points, edge.places, noise))
    rim = Cloud.of(points, places, noise, of_facets=False)
    return replace(within, surface=within.surface.through(cloud.joined(rim), within.stiffness))


def _edge_of(fitted: Fitted, model: Model, masks: PaperMasks, cards: Sequence[CardInView], outline: Floats) -> Edge:
    """Find the edge of the page near an outline (n, 2) mm.

    It is sought where no card lies; the copies are changed there.
    """
    greys = fitted.greys
    ratio = greys.shape[2] / masks.size[0]
    for grey, paper, card in zip(greys, masks.masks, cards, strict=True):
        grey[:] = without_card(grey, paper, card.scaled(ratio).seen)
    return find_edge(masks, greys, model.cameras, fitted.surface, outline)
