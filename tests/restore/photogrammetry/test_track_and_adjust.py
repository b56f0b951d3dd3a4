"""A round gives points of the page, cameras that agree with them, and nothing of the table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from oracles.table_cameras import cameras, mottled, on_plane, picture
from restore.photogrammetry.errors import NoPage
from restore.photogrammetry.model import Model
from restore.photogrammetry.page import PageArea, PaperMasks
from restore.photogrammetry.surfaces.surface import Surface
from restore.photogrammetry.track_and_adjust import FACET_ROUNDS, ROUNDS, play_round

HALF_MM = np.array([80.0, 55.0])
HEIGHT_MM = 4.0  # of the page over the table, and of what is known of it
WIDER_MM = 14.0  # than the page: the area that is assumed
WIDE = replace(ROUNDS[1], spacing=8.0)  # closer: the pictures are small
PRINT = np.stack(np.meshgrid(np.linspace(-60, 60, 9), np.linspace(-40, 40, 7)), axis=-1).reshape(-1, 2)


def is_page(origins, ways) -> np.ndarray:
    return (np.abs(on_plane(origins, ways, HEIGHT_MM)) < HALF_MM).all(axis=1)


@pytest.fixture(scope="module")
def seen() -> tuple[np.ndarray, PaperMasks]:
    """Pictures (v, h, w) of a printed page on a table with a grain, and their masks."""

    def light(origins, ways):
        page, table = mottled(on_plane(origins, ways, HEIGHT_MM)), 0.4 * mottled(1.3 * on_plane(origins, ways, 0.0))
        return np.where(is_page(origins, ways), page, table)

    rng = np.random.default_rng(1)
    exact = np.stack([picture(camera, light) for camera in cameras()])
    masks = np.stack([picture(camera, lambda o, w: is_page(o, w) * 1.0) for camera in cameras()])
    known = PaperMasks(masks.astype(float), (480, 360), np.zeros(masks.shape, bool), np.zeros(len(masks), bool))
    return (exact + rng.normal(0, 1.0, exact.shape)).astype(np.float32), known


def played(seen, plan, off_mm: float):
    """The model after a round, and what that returns; the surface was off, and the cameras moved by 0.3 mm."""
    rng = np.random.default_rng(2)
    moved = [replace(one, vector=one.vector + np.eye(14)[3:6].T @ rng.normal(0, 0.3, 3)) for one in cameras()]
    model = Model(list(range(5)), moved, np.column_stack([PRINT, np.full(len(PRINT), HEIGHT_MM)]), {}, None)
    low = -HALF_MM - WIDER_MM
    surface = Surface.level(low - 10, -low + 10, HEIGHT_MM + off_mm)
    area = PageArea(np.ones((-2 * low).astype(int)[::-1], bool), low)
    return model, play_round(seen[0], model, surface, area, plan, seen[1])


@pytest.mark.parametrize(("plan", "off_mm"), [(WIDE, 1.5), (FACET_ROUNDS[0], 0.2)])
def test_a_round_finds_the_page(seen, plan, off_mm):
    model, (surface, points, feet, facts) = played(seen, plan, off_mm)
    assert facts["surface_points"] == len(points) == len(feet) > 200
    assert facts["reprojection_px"] < 0.3
    axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    out_of_plane = (points - points.mean(axis=0)) @ axes[2]
    scale = np.linalg.norm(np.ptp(points[:, :2], axis=0)) / np.linalg.norm(2 * HALF_MM)
    assert np.median(np.abs(out_of_plane)) < 0.15 * scale  # a fifth of a pixel
    np.testing.assert_allclose(surface.points(feet)[:, :2], points[:, :2], atol=3.0 * scale)
    assert len(model.points) == len(points)


@pytest.mark.parametrize("plan", [WIDE, FACET_ROUNDS[0]])
def test_the_grain_of_the_table_gives_no_points(seen, plan):
    model, (_, points, _, _) = played(seen, plan, 0.0)
    share, _ = seen[1].votes(model.cameras, points)
    assert (share > 0.5).all()


def test_a_blank_page_is_refused(seen):
    blank = np.full_like(seen[0], 128.0)
    with pytest.raises(NoPage, match="print is found again"):
        played((blank, seen[1]), WIDE, 0.0)
