"""A page of many creases becomes a relief, a smooth one stays smooth."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.simulated import MultiFold, Text
from oracles.markers import rigid_residual
from oracles.simulation.photographs import Shots, photograph_page
from oracles.table_cameras import cameras
from restore import Photograph, Settings, reconstruct_page, restore
from restore.photogrammetry import SCALE_CARD
from restore.photogrammetry import refined as module
from restore.photogrammetry.model import Model
from restore.photogrammetry.page import PageArea
from restore.photogrammetry.refined import EXPLAINED, Fitted, missed, refined
from restore.photogrammetry.surfaces import relief
from restore.photogrammetry.surfaces.folded import PAPERS, FoldedSurface, Piece
from restore.photogrammetry.surfaces.surface import Surface, grid_places
from restore.photogrammetry.track_and_adjust import COARSE, ROUNDS
from restore.texture.page import MM_PER_INCH

CARD_DPI = 355.6  # fourteen pixels to a millimetre
MARGIN_MM = 15.0
# The smallest set that is found: half the views that are asked for, and pictures of a megapixel.
VIEWS, WIDTH = 5, 900
NODES = 6000  # of the relief: its facets are 65 mm wide


def test_the_misfit_of_a_surface_is_a_ninetieth_percentile():
    surface = Surface.level(np.array([-50.0, -50.0]), np.array([50.0, 50.0]), 3.0)
    feet = grid_places(np.array([-40.0, -40.0]), np.array([40.0, 40.0]), 4.0)
    above = np.where(np.arange(len(feet)) % 5 == 0, 0.5, 0.01)
    assert missed(surface, surface.points(feet) + above[:, None] * [0.0, 0.0, 1.0], feet) == pytest.approx(0.5)


@pytest.mark.parametrize(("left", "faceted"), [(0.8 * EXPLAINED, True), (1.2 * EXPLAINED, False)])
def test_facets_have_to_explain_what_a_smooth_surface_misses(left, faceted, monkeypatch):
    smooth, facets = (missing(off) for off in (0.5, 0.5 * left))
    model = Model([0], cameras(1), smooth.points, {}, None)

    def of_facets(_joined, model, *_):
        model.cameras = []
        return facets

    monkeypatch.setattr(module, "_of_few_pieces", lambda *_: smooth)
    monkeypatch.setattr(module, "_of_facets", of_facets)
    found = refined([], model, None, smooth.points, lambda *_: None)
    assert found is (facets if faceted else smooth)
    assert len(model.cameras) == (0 if faceted else 1)  # those that belong to the surface


def test_a_round_that_finds_a_crease_is_played_again_up_to_it(monkeypatch):
    found, played = missing(0.0), []
    piece = Piece(found.surface, np.eye(2))
    creased = FoldedSurface(found.surface, (piece, piece), found.feet, np.zeros(0, int), np.zeros(0, int), PAPERS[0])

    def play(_greys, _model, surface, _area, plan, _masks):
        played.append(plan)
        return surface, found.points, found.feet, {}

    monkeypatch.setattr(module, "smoothed_copies", lambda *_: found.greys)
    monkeypatch.setattr(module, "_first_surface", lambda *_: (found.surface, found.area))
    monkeypatch.setattr(module, "play_round", play)
    monkeypatch.setattr(module, "fold", lambda *_: creased)
    monkeypatch.setattr(module, "area_of_votes", lambda *_: found.area)
    model = Model([0], cameras(1), found.points, {}, None)
    refined([], model, None, found.points, lambda *_: None)
    assert played == [COARSE, COARSE, *(plan for plan in ROUNDS[1:] for _ in range(2))]


def missing(off: float) -> Fitted:
    """A plane, all of whose points are as far off."""
    surface = Surface.level(np.array([-50.0, -50.0]), np.array([50.0, 50.0]), 0.0)
    feet = grid_places(np.array([-40.0, -40.0]), np.array([40.0, 40.0]), 4.0)
    points = surface.points(feet) + [0.0, 0.0, off]
    return Fitted(surface, points, feet, 1.0, PageArea(np.ones((2, 2), bool), np.zeros(2)), np.zeros((0, 2, 2)), [])


@pytest.mark.slow
def test_a_folded_map_is_flat_and_true_to_scale(monkeypatch):
    monkeypatch.setattr(relief, "NODES", NODES)
    shots, card = Shots(size=(WIDTH, WIDTH * 3 // 4)), SCALE_CARD.picture(CARD_DPI)
    text = Text(sizes_pt=(10.0,), columns=2, margin_mm=MARGIN_MM)
    taken = photograph_page(MultiFold(), text, views=VIEWS, seed=7, card=card, card_dpi=CARD_DPI, shots=shots)
    photographs = [Photograph(image, str(number), shots.focal_px) for number, image in enumerate(taken.images)]
    page = reconstruct_page(photographs)
    assert page.report["shape"] == "facets"
    restored = restore(page.mesh, Settings(), photos=page.photographs)
    found, true = [], []
    for number, one in enumerate(page.photographs, 1):
        at = np.argwhere(restored.page_source == number)[::50]
        flat, _ = taken.truth_at(int(one.name), restored.page_map[tuple(at.T)].astype(float))
        inside = ((flat > MARGIN_MM) & (flat < np.array(taken.scene.printed.page_mm) - MARGIN_MM)).all(axis=1)
        found.append((at[:, ::-1] * [1, -1] * MM_PER_INCH / restored.dpi)[inside])
        true.append(flat[inside])
    error, scale = rigid_residual(np.concatenate(found), np.concatenate(true))
    assert np.sqrt((error**2).sum(axis=1).mean()) < 0.25
    assert abs(scale - 1) < 0.002  # of fewer and smaller photographs than are asked for
