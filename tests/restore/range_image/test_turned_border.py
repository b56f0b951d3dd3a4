"""A border beyond which paper may be unseen is told by its turn from the line of sight."""

import numpy as np
import pytest

from restore.range_image.border import turned_border


@pytest.fixture
def inside(camera):
    area = np.zeros(camera.shape, bool)
    area[35:125, 40:160] = True
    return area


def test_a_plane_that_faces_the_scanner_is_not_turned(camera, inside):
    assert turned_border(camera.sheet(camera.facets(camera.plane()), inside)) == 0.0


@pytest.mark.parametrize(("slope_deg", "share"), [(60.0, 0.0), (80.0, 1.0)])
def test_a_steep_plane_is_turned_all_round(camera, inside, slope_deg, share):
    normal = (np.sin(np.radians(slope_deg)), 0.0, np.cos(np.radians(slope_deg)))
    assert turned_border(camera.sheet(camera.facets(camera.plane(normal)), inside)) == share


def test_the_two_sides_of_a_roll_are(camera, inside):
    """To 78° at its sides, 60 samples from its ridge; its ends are 120 samples each, its sides 90."""
    away = np.minimum(np.abs(camera.indices[1] - 99.5), 60.0) * camera.pitch_mm
    radius = 60.0 * camera.pitch_mm / np.sin(np.radians(78.0))
    height = np.sqrt(radius**2 - away**2)
    sheet = camera.sheet(camera.facets(1.0 / (1.0 / camera.plane() - height)), inside)
    assert turned_border(sheet) == pytest.approx(2 * 90 / 416, abs=0.04)


def test_what_is_turned_within_the_page_is_not_its_border(camera, inside):
    away = camera.indices[1] - 100.0
    ridge = 1.0 / (1.0 / camera.plane() - np.clip(8.0 - np.abs(away), 0.0, None) * 10.0 * camera.pitch_mm)
    assert turned_border(camera.sheet(camera.facets(ridge), inside)) < 0.08
