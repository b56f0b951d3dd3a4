"""Measures of pages whose truth is known."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from restore import CoverageClass, FlatMesh, RangeScan, RestoredPage
from station.verdict.measures import blur_px, clipped_fraction, depth_window_fraction, measure, seen_in, widest_place

BLUR_ERROR = 0.15  # relative: an edge ends within the window that its height is taken from
SHARP_PX = 0.45  # what a step between two pixels measures: the pixel itself is an average


def printed(seed: int, size: int = 256) -> np.ndarray:
    """A page of black blocks on white paper."""
    random, page = np.random.default_rng(seed), np.full((size, size), 200, np.uint8)
    for _ in range(60):
        x, y = random.integers(10, size - 40, 2)
        page[y : y + 12, x : x + 25] = 30
    return np.dstack([page] * 3)


@pytest.mark.parametrize("sigma", [1.0, 1.5, 2.0])
def test_the_blur_of_edges_is_that_of_the_lens(sigma):
    page = cv2.GaussianBlur(printed(1), (0, 0), sigma)
    assert blur_px(page, np.ones(page.shape[:2], bool)) == pytest.approx(sigma, rel=BLUR_ERROR)


def test_noise_is_not_blur_and_a_blank_page_has_no_edges():
    random = np.random.default_rng(2)
    noisy = np.clip(printed(1) + random.normal(0, 3, (256, 256, 1)), 0, 255).astype(np.uint8)
    everywhere = np.ones((256, 256), bool)
    assert blur_px(noisy, everywhere) < SHARP_PX + 0.3
    assert blur_px(np.full((64, 64, 3), 200, np.uint8), np.ones((64, 64), bool)) is None
    assert blur_px(noisy, np.zeros((256, 256), bool)) is None


def test_the_widest_place():
    mask = np.zeros((40, 40), bool)
    assert widest_place(mask) == 0.0
    mask[10:17, 5:30] = True
    assert widest_place(mask) == pytest.approx(7.0)


@pytest.mark.parametrize(("offset", "share"), [(0.0, 0.0), (1.0, 1.0), (-1.0, 1.0), (0.5, 0.5)])
def test_the_depth_window_is_symmetric_in_inverse_depth(offset, share):
    from drivers.vivid900.geometry.lenses import FINE, LENSES, depth_window

    near, far = depth_window(LENSES["MIDDLE"], FINE, 900.0)
    inverse = (1 / near + 1 / far) / 2 + offset * (1 / near - 1 / far) / 2
    points = np.full((2, 2, 3), -1.0 / inverse)
    facts = {"lens": "MIDDLE", "mode": "fine", "distance_mm": 900}
    assert depth_window_fraction(RangeScan(points, None, np.zeros((2, 2, 2)), facts)) == pytest.approx(share)
    assert depth_window_fraction(RangeScan(points, None, np.zeros((2, 2, 2)), {})) is None


def test_clipped_pixels():
    image = np.full((10, 10, 3), 128, np.uint8)
    image[0] = 0
    image[1, :, 0] = 255
    assert clipped_fraction(image, np.ones((10, 10), bool)) == pytest.approx(0.2)
    assert clipped_fraction(image, np.zeros((10, 10), bool)) == 0.0


def restored_page(image, master):
    """A page of 256 × 256 pixels, 256 mm wide, that shows the picture of its scan pixel by pixel."""
    rows, cols = np.indices((256, 256)).astype(np.float32)
    coverage = np.full((256, 256), CoverageClass.MEASURED, np.uint8)
    coverage[100:110, 100:110] = CoverageClass.OCCLUDED
    flat = FlatMesh(np.empty((0, 3)), np.empty((0, 3), int))
    report = {"strain": {"rms": 0.02, "smooth_rms": 0.001}, "coverage": {"cropped_fraction": 0.125}, **PPI}
    page_map = np.dstack([cols, rows])
    return RestoredPage({}, 25.4, flat, flat, report).with_pictures(
        image=image, mask=coverage > 0, page_map=page_map, master=master, coverage=coverage
    )


def test_a_burnt_page_is_clipped_whatever_its_light_is_divided_by():
    burnt, divided = np.full((2, 256, 256, 3), 255, np.uint8)
    divided[:] = 230
    scan = RangeScan(np.zeros((4, 4, 3)) - 900.0, burnt, np.zeros((4, 4, 2)), {})
    assert measure(restored_page(divided, burnt), scan)["clipped_fraction"] == 1.0
    assert measure(restored_page(burnt, divided), scan)["clipped_fraction"] == 0.0


PPI = {"resolved_ppi": 19.0, "sampling_ppi": 25.4}


def test_all_measures_of_a_page():
    page = printed(1)
    points = np.zeros((4, 4, 3)) - 900.0
    scan = RangeScan(points, page, np.zeros((4, 4, 2)), {})
    restored = restored_page(page, page)
    measured = measure(restored, scan)
    assert measured["measured_fraction"] == pytest.approx(1 - 100 / 256**2)
    assert measured["hole_mm"] == pytest.approx(9.0, abs=1.0)
    assert (measured["smooth_strain_rms"], measured["sampling_ppi"], measured["depth_window_fraction"]) == (
        0.001,
        25.4,
        None,
    )
    bare = measure(restored, RangeScan(points, None, np.zeros((4, 4, 2)), {}))
    assert [bare[name] for name in ("sampling_ppi", "blur_px", "clipped_fraction")] == [None] * 3
    assert measured["cropped_fraction"] == 0.125
    assert seen_in(restored.page_map, (256, 256)).all()
