"""Points where no patch was tracked: on the surface, not beside tracked ones, none where the page shows nothing."""

from __future__ import annotations

import numpy as np
import pytest

from oracles.table_cameras import cameras, mottled, on_plane, picture
from restore.photogrammetry.gaps import NOISE_MM, SPACING_MM, _among_neighbours, fill_gaps
from restore.photogrammetry.model import Model
from restore.photogrammetry.page import PageArea
from restore.photogrammetry.surfaces.relief import Relief
from restore.photogrammetry.surfaces.surface import Surface

HEIGHT_MM = 1.7  # of the page over the relief
BLANK_MM = 15.0  # x beyond which the page has no print
LOW, HIGH = np.array([-50.0, -40.0]), np.array([50.0, 40.0])
STEP_MM = 2.0
TRACKED = np.array([[-30.0, 0.0], [-10.0, 10.0]])


def printed(places: np.ndarray) -> np.ndarray:
    return np.where(places[:, 0] < BLANK_MM, mottled(places), 125.0)


@pytest.fixture(scope="module")
def filled():
    views = cameras()
    rng = np.random.default_rng(1)
    exact = np.stack([picture(view, lambda o, w: printed(on_plane(o, w, HEIGHT_MM))) for view in views])
    greys = (exact + rng.normal(0, 1.0, exact.shape)).astype(np.float32)
    base = Surface.level(LOW - 5, HIGH + 5, 0.0)
    relief = Relief(base, LOW - 5, STEP_MM, np.zeros((46, 56)))
    model = Model(list(range(len(views))), views, np.zeros((0, 3)), {}, None)
    area = PageArea(np.ones((80, 100), bool), LOW)
    return fill_gaps(greys, model, relief, area, TRACKED)


def test_gaps_are_filled_with_points_of_the_page(filled):
    assert len(filled.points) > 500
    error = filled.points[:, 2] - HEIGHT_MM
    assert abs(np.median(error)) < 0.03
    assert 0.2 * NOISE_MM < np.sqrt((error**2).mean()) < 3 * NOISE_MM  # pixels of 0.7 mm: three times as large as usual
    np.testing.assert_allclose(filled.feet, filled.points[:, :2], atol=0.05)
    assert (filled.noise == NOISE_MM).all() and filled.of_facets.all()


def test_nothing_is_measured_where_there_is_nothing(filled):
    assert np.mean(filled.points[:, 0] > BLANK_MM + 4) < 0.01


def test_tracked_points_are_exact_enough(filled):
    assert np.linalg.norm(filled.feet[:, None] - TRACKED, axis=2).min() > SPACING_MM - 0.05


def test_heights_that_a_crease_parts_are_kept_and_a_blunder_is_not():
    places = SPACING_MM * np.stack(np.meshgrid(np.arange(7.0), np.arange(7.0)), axis=-1).reshape(-1, 2)
    heights = np.where(places[:, 0] > 3.5 * SPACING_MM, 7 * NOISE_MM, 0.0)
    heights[10] = 30 * NOISE_MM
    np.testing.assert_array_equal(_among_neighbours(places, heights), np.arange(len(places)) != 10)
