"""What a hand draws, and what it draws it on: a finger, a torn corner, an outline."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.simulated import Text, shoot
from drivers.simulated.scene.sheets import Flat
from oracles.hand import HEIGHT_MM, Drawing, draw, lay_finger, outline_uv, tear_corner

PAGE_MM = (120.0, 90.0)
PX_PER_MM = 2.1
PIXEL_MM = 0.05  # of the canvas that areas are counted on: one row and one column too many


@pytest.fixture(scope="module")
def flat():
    return shoot(Flat(), Text(margin_mm=8.0, title_pt=12.0, sizes_pt=(8.0,)), page_mm=PAGE_MM, mode="fast")


def test_a_drawing_has_the_area_of_the_sheet_within_it():
    outside = np.array([[-10.0, 10.0], [20.0, 10.0], [20.0, 50.0], [-10.0, 50.0]])
    assert Drawing(outside, outside).on_paper_mm2(PAGE_MM) == pytest.approx(20 * 40, abs=61 * PIXEL_MM)
    upper = np.array([[0.0, 30.0], [120.0, 30.0], [120.0, 90.0], [0.0, 90.0]])
    assert Drawing(outside, outside).on_paper_mm2(PAGE_MM, upper) == pytest.approx(20 * 20, abs=41 * PIXEL_MM)


def test_an_outline_follows_the_edges_and_the_tear():
    assert Drawing(outline_uv(PAGE_MM), outline_uv(PAGE_MM)).on_paper_mm2(PAGE_MM) == pytest.approx(120 * 90, rel=0.005)
    tear = np.array([[90.0, 90.0], [105.0, 78.0], [120.0, 70.0]])
    torn = outline_uv(PAGE_MM, tear)
    missing = 120 * 90 - Drawing(torn, torn).on_paper_mm2(PAGE_MM)
    assert missing == pytest.approx(15 * (0 + 12) / 2 + 15 * (12 + 20) / 2, rel=0.02)


def test_points_lie_where_the_sheet_is_seen(flat):
    scan, truth = flat
    drawn = draw(scan, truth, np.array([[30.0, 20.0], [100.0, 70.0], [10.0, 80.0]]), np.random.default_rng(0), 0.0)
    for uv, px in zip(drawn.uv, drawn.px, strict=True):
        at = np.unravel_index(np.argmin(np.linalg.norm(scan.texture_xy - px, axis=-1)), scan.measured.shape)
        assert np.linalg.norm(truth.flat[at] - uv) < 0.9  # the nearest sample of the fast mode


def test_a_finger_stands_above_the_page(flat):
    scan, truth = flat
    touched, outline = lay_finger(scan, truth, np.random.default_rng(3))
    raised = np.nan_to_num(touched.points[..., 2] - scan.points[..., 2])
    assert raised.max() == pytest.approx(HEIGHT_MM, abs=1.0)
    x, y = truth.flat[raised > 0.5 * HEIGHT_MM].T
    known = np.isfinite(x)
    low, high = outline.min(axis=0), outline.max(axis=0)
    assert (low[0] <= x[known].min(), x[known].max() <= high[0], y[known].max() <= high[1]) == (True, True, True)
    assert (touched.texture != scan.texture).any(axis=2).mean() > 0.005


def test_where_a_corner_is_torn_off_the_table_is_seen(flat):
    scan, truth = flat
    torn, tear = tear_corner(scan, truth, np.random.default_rng(3))
    corner = (truth.flat > tear.max(axis=0) - 6.0).all(axis=-1) & torn.measured
    table = np.nanmedian(scan.points[..., 2][~np.isfinite(truth.flat[..., 0])])
    assert np.abs(torn.points[..., 2][corner] - table).max() < 0.6
    on_page = np.isfinite(truth.flat[..., 0]) & scan.measured
    same = on_page & ~(truth.flat > tear.min(axis=0) - 5.0).all(axis=-1)
    np.testing.assert_array_equal(torn.points[same], scan.points[same])
