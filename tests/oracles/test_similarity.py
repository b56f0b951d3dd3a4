"""MS-SSIM: what it must be by its definition, and how it answers to known changes."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from drivers.simulated.scene.artwork import Text
from oracles.similarity import WEIGHTS, align_page, lay_on, ms_ssim, page_similarity

ROUNDING = 1e-9


@pytest.fixture(scope="module")
def grey():
    page = Text(title_pt=20, sizes_pt=(14.0,), margin_mm=10).print_on((140.0, 100.0)).image
    return cv2.cvtColor(cv2.resize(page, (800, 570), interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2GRAY)


def test_a_picture_is_wholly_like_itself_and_likeness_is_mutual(grey):
    noisy = np.clip(grey + np.random.default_rng(1).normal(0, 8, grey.shape), 0, 255).astype(np.uint8)
    assert ms_ssim(grey, grey) == pytest.approx(1.0, abs=ROUNDING)
    assert ms_ssim(grey, noisy) == pytest.approx(ms_ssim(noisy, grey), abs=ROUNDING)
    assert 0 < ms_ssim(grey, noisy) < 1


def test_two_even_greys_differ_by_the_luminance_term_alone():
    a, b = 60.0, 180.0
    luminance = (2 * a * b + 2.55**2) / (a**2 + b**2 + 2.55**2)  # eq. 1, C1 = (0.01 · 255)²
    pictures = (np.full((200, 240), level, np.uint8) for level in (a, b))
    assert ms_ssim(*pictures) == pytest.approx(luminance ** WEIGHTS[-1], abs=ROUNDING)


def test_half_the_contrast_is_the_contrast_term_alone():
    """Halving white noise of variance v leaves (v + C2) / (5/4 v + C2) in a window; each scale has a quarter of v."""
    noise = np.random.default_rng(2).choice([28, 228], (704, 704)).astype(np.uint8)
    halved = (noise.astype(int) // 2 + 64).astype(np.uint8)
    c2, variances = (0.03 * 255) ** 2, 100.0**2 / 4.0 ** np.arange(5)
    expected = np.prod(((variances + c2) / (1.25 * variances + c2)) ** np.array(WEIGHTS))
    assert ms_ssim(noise, halved) == pytest.approx(expected, abs=0.003)  # windows see a few per cent less variance


def test_a_negative_is_not_a_likeness(grey):
    assert ms_ssim(grey, 255 - grey) < 0.01


@pytest.mark.parametrize("change", ["shift", "blur", "noise"])
def test_more_change_is_less_like(grey, change):
    rng = np.random.default_rng(3).normal(size=grey.shape)
    changes = {
        "shift": lambda k: np.roll(grey, k, axis=1),
        "blur": lambda k: cv2.GaussianBlur(grey, (0, 0), k),
        "noise": lambda k: np.clip(grey + 10 * k * rng, 0, 255).astype(np.uint8),
    }
    scores = [ms_ssim(grey, changes[change](k)) for k in (1, 2, 4)]
    assert scores == sorted(scores, reverse=True)
    assert scores[0] - scores[-1] > 0.02


def test_the_size_of_the_pictures_does_not_matter_to_pages():
    page = Text(title_pt=20, sizes_pt=(14.0,), margin_mm=10).print_on((140.0, 100.0)).image
    half = cv2.resize(page, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    assert page_similarity(half, page) > 0.98


def test_a_page_that_lies_elsewhere_is_laid_on_its_original_but_not_stretched():
    page = Text(title_pt=20, sizes_pt=(14.0,), margin_mm=10).print_on((140.0, 100.0)).image
    flat = cv2.resize(page, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    around = cv2.copyMakeBorder(flat, 2, 3, 7, 1, cv2.BORDER_REPLICATE)
    assert page_similarity(lay_on(around, align_page(around, flat), flat), flat) > 0.99 > page_similarity(around, flat)
    wide = cv2.resize(flat, None, fx=1.01, fy=1.0, interpolation=cv2.INTER_CUBIC)
    assert page_similarity(lay_on(wide, align_page(wide, flat), flat), flat) < 0.95
