"""Heights found by likeness of the views, against an exact plane."""

from __future__ import annotations

import numpy as np
import pytest

from oracles.table_cameras import cameras, mottled, on_plane, picture
from restore.photogrammetry.sweep import sweep
from restore.photogrammetry.track import Patches

SAMPLE_MM = 0.7  # a pixel on the table
HEIGHT_MM = 5.0
OFFSETS_MM = np.arange(-2.0, 2.05, 0.1)
GRID = np.stack(np.meshgrid(np.linspace(-60, 60, 13), np.linspace(-40, 40, 9)), axis=-1).reshape(-1, 2)
NOISE_CODES = 1.0


def photographed(light) -> np.ndarray:
    """(v, h, w) pictures of a plane whose light (n,) is a function of places (n, 2) mm; exposures differ."""
    rng = np.random.default_rng(1)
    exact = [picture(camera, lambda o, w: light(on_plane(o, w, HEIGHT_MM))) for camera in cameras()]
    gains = (1.0, 0.8, 1.1, 0.9, 1.05)
    noisy = [g * e + 5 + rng.normal(0, NOISE_CODES, e.shape) for g, e in zip(gains, exact, strict=True)]
    return np.stack(noisy).astype(np.float32)


@pytest.fixture(scope="module")
def greys() -> np.ndarray:
    return photographed(mottled)


def level(height: float) -> Patches:
    count = len(GRID)
    points = np.column_stack([GRID, np.full(count, height)])
    tangents, normals = np.tile(np.eye(3)[:2], (count, 1, 1)), np.tile([0.0, 0.0, 1.0], (count, 1))
    return Patches(points, tangents, normals, np.zeros((count, 3)))


@pytest.mark.parametrize("off_mm", [0.0, 0.33, -1.5])
def test_heights_are_those_of_the_plane(greys, off_mm):
    heights, sigma, alike = sweep(greys, cameras(), level(HEIGHT_MM - off_mm), SAMPLE_MM, OFFSETS_MM)
    good = (alike > 0.9) & (sigma < 0.2)
    assert good.mean() > 0.9
    error = heights[good] - off_mm
    assert abs(np.median(error)) < 0.02
    assert np.sqrt((error**2).mean()) < 0.1  # a fifth of a pixel of the parallax
    assert 0.3 < np.sqrt((error**2).mean()) / np.sqrt((sigma[good] ** 2).mean()) < 3


def test_a_view_that_something_hides_does_not_count(greys):
    hidden = greys.copy()
    hidden[2] = greys[2, ::-1, ::-1]
    heights, _, alike = sweep(hidden, cameras(), level(HEIGHT_MM - 0.33), SAMPLE_MM, OFFSETS_MM)
    good = alike > 0.9
    assert good.mean() > 0.6
    assert np.quantile(np.abs(heights[good] - 0.33), 0.9) < 0.15


def test_an_edge_of_light_on_blank_paper_shows_its_height():
    greys = photographed(lambda places: np.where(places[:, 0] + 0.4 * places[:, 1] > 0, 180.0, 150.0))
    heights, sigma, alike = sweep(greys, cameras(), level(HEIGHT_MM - 0.5), SAMPLE_MM, OFFSETS_MM)
    on_edge = np.abs(GRID[:, 0] + 0.4 * GRID[:, 1]) < 1.0
    good = (alike > 0.75) & (sigma < 0.3)
    assert good[on_edge].mean() > 0.8
    assert np.median(np.abs(heights[good & on_edge] - 0.5)) < 0.15
    far = np.abs(GRID[:, 0] + 0.4 * GRID[:, 1]) > 10.0
    assert not good[far].any()


def test_blank_paper_and_other_pages_show_no_height(greys):
    rng = np.random.default_rng(2)
    blank = (120 + rng.normal(0, NOISE_CODES, greys.shape)).astype(np.float32)
    other = greys.copy()
    other[1:] = greys[1:, ::-1]
    for pictures in (blank, other):
        _, _, alike = sweep(pictures, cameras(), level(HEIGHT_MM), SAMPLE_MM, OFFSETS_MM)
        assert np.mean(alike > 0.75) < 0.05  # three of five views may be so by chance


def test_what_lies_out_of_reach_has_no_height(greys):
    heights, _, alike = sweep(greys, cameras(), level(HEIGHT_MM - 2.02), SAMPLE_MM, OFFSETS_MM)
    assert np.mean(alike > 0.9) < 0.1
    assert np.isnan(heights[np.isnan(alike)]).all()
