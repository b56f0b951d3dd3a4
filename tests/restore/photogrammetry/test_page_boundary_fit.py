"""The edge of a page tells of its paper where nothing is printed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivers.simulated import Spread, Wave
from drivers.simulated.scene.sheets import Sheet
from oracles.printed_points import HALF, MARGIN_MM, PAGE_MM, lost, rounded, sampled
from restore.photogrammetry import page_boundary_fit as rim
from restore.photogrammetry.page import PageArea, PaperMasks
from restore.photogrammetry.page_boundary import SPACING_MM, Edge
from restore.photogrammetry.refined import Fitted
from restore.photogrammetry.surfaces.folded import FoldedSurface, fold, refold
from restore.photogrammetry.surfaces.page_surface import PageSurface
from restore.photogrammetry.surfaces.surface import fit_surface
from restore.scan import Floats

SPREAD = Spread(slope_deg=58.0, reach_mm=30.0)
BLANK_MM = 9.0  # beside the spine
NOISE_MM = 0.03  # of the edge
LOST_MM = 0.3  # of 18 mm that have no print, a third of what is lost without the edge
WAVE = Wave(slope_deg=25.0, wavelength_mm=170.0)
STIFFNESS = 10.0  # mm⁴: as photographs of waves choose it
OFF_MM = 0.1  # three times the noise of the edge
NO_PHOTOGRAPHS = np.zeros((0, 8, 8))


def edge_of_page(sheet: Sheet, seed: int) -> Edge:
    """The exact edge of a sheet, with noise, its places not yet known better than on the flat page."""
    x, y = (np.arange(-half, half, SPACING_MM) for half in HALF)
    sides = [(x, -HALF[1]), (HALF[0], y), (-x, HALF[1]), (-HALF[0], -y)]
    flat = np.concatenate([np.column_stack(np.broadcast_arrays(*side)) for side in sides])
    points = sheet.warp(flat, PAGE_MM) + NOISE_MM * np.random.default_rng(seed).standard_normal((len(flat), 3))
    return Edge(points, flat, np.ones(len(flat), bool))


def fitted_to_edge(surface: PageSurface, points: Floats, feet: Floats, stiffness: float) -> tuple[Fitted, Edge]:
    area = PageArea(np.ones((2, 2), bool), np.zeros(2))
    masks = PaperMasks(NO_PHOTOGRAPHS, (8, 8), NO_PHOTOGRAPHS > 0, np.zeros(0, bool))
    fitted = Fitted(surface, points, feet, stiffness, area, NO_PHOTOGRAPHS, [])
    return rim.fit_to_edge(fitted, None, masks, [])


@pytest.fixture(scope="module")
def gutter() -> tuple[FoldedSurface, Floats, Floats]:
    """A surface folded in a gutter without print, from points on both sides of it, the points and their feet."""
    points, flat = sampled(SPREAD)
    points = points[np.abs(flat[:, 0]) > BLANK_MM]
    smooth, feet = rounded(SPREAD, points)
    surface = fold(points, feet, smooth)
    assert isinstance(surface, FoldedSurface)
    return refold(points, surface.feet(points, feet), surface), points, feet


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_gutter_between_two_printed_pages_is_as_wide_as_it_was(seed, gutter, monkeypatch):
    surface, points, feet = gutter
    edge = edge_of_page(SPREAD, seed)
    edge = Edge(edge.points, surface.feet(edge.points, edge.places), edge.measured)
    near = list[FoldedSurface]()
    monkeypatch.setattr(rim, "_edge_of", lambda fitted, *_: near.append(fitted.surface) or edge)
    found, reported = fitted_to_edge(surface, points, feet, 0.0)
    assert reported is edge
    assert near[0] is surface is not near[1]  # sought again near the surface that goes through the first
    assert abs(lost(found.surface, SPREAD)) < LOST_MM < lost(surface, SPREAD) / 3


@pytest.mark.parametrize("drop", [3.0, 12.0])
def test_points_of_the_table_next_to_a_margin_do_not_tear_it_down(drop, monkeypatch):
    points, _ = sampled(WAVE)
    beyond = np.column_stack([np.full(8, -HALF[0] - 4.0), np.linspace(-20, 20, 8)])
    table = WAVE.warp(beyond, PAGE_MM) - [0.0, 0.0, drop]
    smooth, _ = rounded(WAVE, points)
    everything = np.concatenate([points, table])
    surface, feet = fit_surface(everything, smooth.nearest(everything), smooth, stiffness=STIFFNESS)
    edge = edge_of_page(WAVE, 4)
    near = list[PageSurface]()

    def found_near(fitted: Fitted, *_: object) -> Edge:
        near.append(fitted.surface)
        return replace(edge, places=fitted.surface.smooth.nearest(edge.points))

    monkeypatch.setattr(rim, "_edge_of", found_near)
    found, _ = fitted_to_edge(surface, everything, feet, STIFFNESS)
    assert len(found.points) == len(points)
    # In the middle of the margin, where neither print nor edge holds it; beside the table's points it was torn down.
    margin = WAVE.warp(np.column_stack([np.full(40, -HALF[0] + MARGIN_MM / 2), np.linspace(-60, 60, 40)]), PAGE_MM)
    assert off(found.surface, margin) < OFF_MM < off(surface, margin) / 2


def off(surface: PageSurface, points: Floats) -> float:
    """How far the farthest of points (n, 3) mm lies from a smooth surface, mm."""
    return float(np.linalg.norm(surface.smooth.points(surface.smooth.nearest(points)) - points, axis=1).max())
