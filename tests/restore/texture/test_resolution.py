"""What a picture resolves is measured on its own edges: exact blurs, noise, thin strokes, shadows, no edges."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from restore.texture.resolution import (
    NO_EDGES,
    NO_PICTURE,
    Resolution,
    edge_mtf50,
    print_or_outline_mtf50,
    resolved_fraction,
)

FINE = 6  # subpixels to a pixel's side: sharp pictures are drawn so much finer and averaged
MAX_NOISE = 2.5  # codes: among more, the faintest ink has too few edges that stand out to tell anything
WITHIN = 0.07  # of the MTF50: half of what a report may be off; codes, bins and window make some hundredths
WIDE = 24.0  # pixels: a bar whose edges are isolated even in a copy of half the size


def exact(blur_px):
    """MTF50 of a Gaussian and a square pixel."""
    return brentq(lambda f: np.exp(-2 * (np.pi * blur_px * f) ** 2) * np.sinc(f) - 0.5, 0.0, 0.7)


def drawn(blur_px, *, bar=WIDE, noise=0.0, contrast=0.8, seed=0, size=240, sharpen=0.0, fine=FINE):
    """(h, w, 3) codes of turned bars of ink, blurred by a lens and averaged over pixels."""
    rng = np.random.default_rng(seed)
    ink = np.zeros((size * fine, size * fine), np.float32)
    for row in range(3):
        for col in range(3):
            middle = (np.array([col, row]) + 0.5) * size * fine / 3
            box = cv2.boxPoints((middle.tolist(), (bar * fine, size * fine / 5), float(rng.uniform(0, 90))))
            cv2.fillPoly(ink, [box.astype(np.int32)], 1.0)
    if blur_px:
        ink = cv2.GaussianBlur(ink, (0, 0), blur_px * fine)
    light = 0.85 - contrast * cv2.resize(ink, (size, size), interpolation=cv2.INTER_AREA)
    light += sharpen * (light - cv2.GaussianBlur(light, (0, 0), 1.0))
    codes = 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055)
    codes = codes + rng.normal(0, noise, codes.shape)
    return np.repeat(np.clip(codes, 0, 255).round().astype(np.uint8)[..., None], 3, axis=2)


def mtf50_of_picture(picture):
    return edge_mtf50(picture, np.ones(picture.shape[:2], bool))


@pytest.mark.parametrize("blur_px", [0.25, 0.35, 0.6, 1.0])
def test_the_mtf50_is_that_of_lens_and_pixel(blur_px):
    assert mtf50_of_picture(drawn(blur_px)) == pytest.approx(exact(blur_px), rel=WITHIN)


@pytest.mark.parametrize("blur_px", [1.6, 2.5, 4.0])
def test_wide_edges_are_measured_in_smaller_copies(blur_px):
    picture = drawn(blur_px, bar=24 * blur_px, size=800, fine=2)
    assert mtf50_of_picture(picture) == pytest.approx(exact(blur_px), rel=WITHIN)


def test_a_picture_of_ideal_pixels_has_no_more_than_its_pixels():
    assert resolved_fraction(mtf50_of_picture(drawn(0.0))) == 1.0


@settings(max_examples=8, deadline=None)
@given(noise=st.floats(0, MAX_NOISE), contrast=st.floats(0.3, 0.8), seed=st.integers(0, 99))
def test_noise_and_faint_ink_change_nothing(noise, contrast, seed):
    picture = drawn(0.6, noise=noise, contrast=contrast, seed=seed)
    assert mtf50_of_picture(picture) == pytest.approx(exact(0.6), rel=WITHIN)


def test_sharpening_raises_the_mtf50_by_what_it_does_to_the_spectrum():
    amount = 0.6

    def mtf(f):
        unsharp = 1 + amount * (1 - np.exp(-2 * (np.pi * f) ** 2))
        return np.exp(-2 * (np.pi * 0.6 * f) ** 2) * np.sinc(f) * unsharp - 0.5

    sharpened = drawn(0.6, sharpen=amount, contrast=0.6)
    assert mtf50_of_picture(sharpened) == pytest.approx(brentq(mtf, 0.0, 0.7), rel=WITHIN)


def test_the_soft_edge_of_a_shadow_does_not_count_next_to_ink():
    picture = drawn(0.6).astype(float)
    shade = 1 - 0.35 * cv2.GaussianBlur((np.indices(picture.shape[:2])[1] > 120).astype(float), (0, 0), 1.0)
    darker = (picture * shade[..., None]).astype(np.uint8)
    assert mtf50_of_picture(darker) == pytest.approx(exact(0.6), rel=WITHIN)


def test_only_edges_under_the_mask_count():
    picture = np.concatenate([drawn(0.5), drawn(1.0)], axis=1)
    left = np.zeros(picture.shape[:2], bool)
    left[:, :235] = True
    assert edge_mtf50(picture, left) == pytest.approx(exact(0.5), rel=WITHIN)
    assert edge_mtf50(picture, ~left) == pytest.approx(exact(1.0), rel=WITHIN)


def test_a_curved_outline_is_measured_along_its_curve():
    y, x = np.indices((300 * FINE, 300 * FINE)) / FINE
    sheet = cv2.GaussianBlur((np.hypot(x - 150, y - 150) < 110).astype(np.float32), (0, 0), 0.6 * FINE)
    light = cv2.resize(0.05 + 0.8 * sheet, (300, 300), interpolation=cv2.INTER_AREA)
    codes = np.round(255 * (1.055 * light ** (1 / 2.4) - 0.055)).astype(np.uint8)
    assert mtf50_of_picture(np.dstack([codes] * 3)) == pytest.approx(exact(0.6), rel=WITHIN)


@pytest.mark.parametrize(
    "picture", [np.full((90, 120, 3), 200, np.uint8), np.full((5, 7, 3), 200, np.uint8), drawn(0.6, bar=3.0)]
)
def test_a_picture_without_isolated_edges_says_nothing(picture):
    assert mtf50_of_picture(picture) is None


def test_a_period_takes_two_pixels_and_no_picture_has_more_than_its_own():
    assert resolved_fraction(0.2) == pytest.approx(0.4)
    assert resolved_fraction(0.6) == resolved_fraction(None) == 1.0


def test_print_counts_before_the_outline_and_the_outline_where_print_is_missing():
    page = np.zeros((300, 300), bool)
    page[30:270, 30:270] = True
    picture = np.zeros((300, 300, 3), np.uint8)
    picture[30:270, 30:270] = drawn(1.0)
    assert print_or_outline_mtf50(picture, page) == pytest.approx(exact(1.0), rel=WITHIN)
    sheet = cv2.GaussianBlur(page.astype(np.float32), (0, 0), 1.0)
    light = 0.05 + 0.8 * cv2.warpAffine(sheet, cv2.getRotationMatrix2D((150, 150), 7, 1), (300, 300))
    blank = np.dstack([(255 * light ** (1 / 2.2)).astype(np.uint8)] * 3)
    assert print_or_outline_mtf50(blank, page) == pytest.approx(0.18, rel=0.15)


def test_what_a_report_says():
    known, unknown, none = Resolution(100.0, 0.3), Resolution(100.0), Resolution(0.0)
    assert known.described() == {
        "resolved_ppi": pytest.approx(60.0),
        "sampling_ppi": 100.0,
        "mtf50_per_mm": pytest.approx(0.3 * 100 / 25.4),
    }
    assert unknown.described()["resolved_ppi"] is None
    assert unknown.described()["resolved_ppi_unknown"] == NO_EDGES
    assert none.described()["resolved_ppi"] == 0.0
    assert none.described()["resolved_ppi_unknown"] == NO_PICTURE


def test_what_a_picture_resolves_is_measured_once_when_it_is_first_read():
    measured = []
    found = Resolution(150.0, lambda: measured.append(1) or 0.25)
    assert not measured
    assert (found.mtf50, found.resolved_ppi, found.mtf50) == (0.25, 75.0, 0.25)
    assert len(measured) == 1
