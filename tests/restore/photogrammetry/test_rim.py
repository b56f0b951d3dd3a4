"""The edge of a page tells of its paper where nothing is printed."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.simulated import Spread
from oracles.printed_points import HALF, PAGE_MM, lost, rounded, sampled
from restore.photogrammetry import rim
from restore.photogrammetry.edges import SPACING_MM, Edge
from restore.photogrammetry.folded import FoldedSurface, fold, refold
from restore.photogrammetry.page import PageArea, PaperMasks
from restore.photogrammetry.refined import Fitted

SPREAD = Spread(slope_deg=58.0, reach_mm=30.0)
BLANK_MM = 9.0  # beside the spine
NOISE_MM = 0.03  # of the edge
LOST_MM = 0.3  # of 18 mm that have no print, a third of what is lost without the edge
NO_PHOTOGRAPHS = np.zeros((0, 8, 8))


def edge_of_page(seed: int) -> Edge:
    """The exact edge of the spread, with noise, its places not yet known better than on the flat page."""
    x, y = (np.arange(-half, half, SPACING_MM) for half in HALF)
    sides = [(x, -HALF[1]), (HALF[0], y), (-x, HALF[1]), (-HALF[0], -y)]
    flat = np.concatenate([np.column_stack(np.broadcast_arrays(*side)) for side in sides])
    points = SPREAD.warp(flat, PAGE_MM) + NOISE_MM * np.random.default_rng(seed).standard_normal((len(flat), 3))
    return Edge(points, flat, np.ones(len(flat), bool))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_gutter_between_two_printed_pages_is_as_wide_as_it_was(seed, monkeypatch):
    points, flat = sampled(SPREAD)
    printed = np.abs(flat[:, 0]) > BLANK_MM
    points = points[printed]
    smooth, feet = rounded(SPREAD, points)
    surface = fold(points, feet, smooth)
    assert isinstance(surface, FoldedSurface)
    surface = refold(points, surface.feet(points, feet), surface)
    edge = edge_of_page(seed)
    edge = Edge(edge.points, surface.feet(edge.points, edge.places), edge.measured)
    near = list[FoldedSurface]()
    monkeypatch.setattr(rim, "_edge_of", lambda fitted, *_: near.append(fitted.surface) or edge)
    fitted = Fitted(surface, points, feet, 0.0, PageArea(np.ones((2, 2), bool), np.zeros(2)), NO_PHOTOGRAPHS, [])
    found, told = rim.fit_to_edge(
        fitted, None, PaperMasks(NO_PHOTOGRAPHS, (8, 8), NO_PHOTOGRAPHS > 0, np.zeros(0, bool)), []
    )
    assert told is edge
    assert near[0] is surface is not near[1]  # sought again near the surface that goes through the first
    assert abs(lost(found, SPREAD)) < LOST_MM < lost(surface, SPREAD) / 3
