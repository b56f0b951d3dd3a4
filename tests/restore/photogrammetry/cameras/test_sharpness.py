"""Blur is measured in pixels, whatever the picture shows."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from restore.photogrammetry.cameras.sharpness import sharpness

NOISE_CODES = 2.0
ACCURACY = 0.15  # of the blur: a window of 31 pixels cuts the foot of wide edges off


def blocks(blur_px, seed=1):
    """A picture of large blocks, blurred by a Gaussian and then noisy."""
    rng = np.random.default_rng(seed)
    small = rng.integers(0, 2, (12, 16)).astype(np.float32) * 120 + 60
    grey = cv2.resize(small, None, fx=40, fy=40, interpolation=cv2.INTER_NEAREST)
    grey = cv2.GaussianBlur(grey, (0, 0), blur_px) + rng.normal(0, NOISE_CODES, grey.shape)
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("blur_px", [1.0, 2.0, 3.0, 4.0])
def test_a_blurred_step_has_the_width_of_its_blur(blur_px):
    assert sharpness(blocks(blur_px)).blur == pytest.approx(blur_px, rel=ACCURACY)


def test_light_and_contrast_do_not_matter():
    dark = (blocks(2.0) * 0.4).astype(np.uint8)
    assert sharpness(dark).blur == pytest.approx(sharpness(blocks(2.0)).blur, rel=ACCURACY)
    assert sharpness(dark).contrast == pytest.approx(0.4 * sharpness(blocks(2.0)).contrast, rel=ACCURACY)


def test_a_blank_picture_has_no_contrast():
    assert sharpness(np.full((300, 400), 128, np.uint8)).contrast == 0.0
