"""Page and card are pushed as rigid things, each by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivers.simulated import Markers, Wave
from drivers.simulated.imaging.shot import printed
from drivers.simulated.scene.scene import TablePicture, place_sheet
from oracles.simulation.mishaps import moved_card, moved_page

PAGE_MM = (120.0, 90.0)
PLACES = np.array([[10.0, 20.0], [110.0, 15.0], [60.0, 80.0]])
EXACT = 1e-9


@pytest.fixture
def scene():
    card = TablePicture(np.full((20, 50, 3), 255, np.uint8), 100.0, (0.0, -70.0), 2.0)
    placed = place_sheet(Wave(), printed(Markers(), PAGE_MM), depth_mm=900.0, table="light")
    return replace(placed, lying=card)


def test_the_page_is_pushed_over_the_table(scene):
    moved = moved_page(scene, (7.0, -3.0), 0.0)
    page = np.unique(scene.faces[scene.on_page])
    np.testing.assert_allclose(moved.vertices[page] - scene.vertices[page], [[7.0, -3.0, 0.0]] * len(page), atol=EXACT)
    table = np.setdiff1d(np.arange(len(scene.vertices)), page)
    np.testing.assert_array_equal(moved.vertices[table], scene.vertices[table])


def test_the_exact_surface_moves_with_the_page(scene):
    moved = moved_page(scene, (5.0, 2.0), 30.0)
    page = np.unique(scene.faces[scene.on_page])
    np.testing.assert_allclose(moved.surface(moved.page_uv[page]), moved.vertices[page], atol=1e-6)
    before, after = (np.linalg.norm(np.diff(one.surface(PLACES), axis=0), axis=1) for one in (scene, moved))
    np.testing.assert_allclose(after, before, atol=EXACT)
    np.testing.assert_allclose(moved.surface(PLACES)[:, 2], scene.surface(PLACES)[:, 2], atol=EXACT)


def test_the_card_is_pushed_alone(scene):
    moved = moved_card(scene, (4.0, -6.0), 3.0)
    assert moved.lying.middle_mm == (4.0, -76.0)
    assert moved.lying.turn_deg == 5.0
    np.testing.assert_array_equal(moved.vertices, scene.vertices)
    bare = moved_card(replace(scene, lying=None), (1.0, 1.0), 1.0)
    assert bare.lying is None
