"""Super-resolution against a picture of which every finer pixel is known."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from drivers.simulated.scene.artwork import Text
from restore.errors import BadInput
from restore.scan import RangeScan
from restore.texture.super_resolution import FACTOR, LENS_BLUR_PX, registration, super_resolve, super_resolve_images

FINE = 8  # pixels of the known picture to one of an image
SIZE = 96, 128  # rows, columns of the images
SHIFTS = [(0, 0), (4, 0), (0, 4), (4, 4), (-3, 5), (6, -2)]  # eighths of a pixel, right and down
MAX_ERROR_RATIO = 0.67  # the rest is the lens's blur and the pixel's area, which nothing brings back whole
MAX_OVERSHOOT = 3  # codes: the noise of the mean of six images
REGISTRATION_PX = 0.05  # of a registration: its parabola is fitted to noise and aliasing


@pytest.fixture(scope="module")
def known():
    """A printed page at FINE pixels to one of the images, with a margin to shift in."""
    page = Text(title_pt=16, sizes_pt=(10.0,), margin_mm=4).print_on((62.0, 47.0)).image
    size = (SIZE[1] + 4) * FINE, (SIZE[0] + 4) * FINE
    return cv2.resize(page, size, interpolation=cv2.INTER_AREA)


def seen(known: np.ndarray, dx: int, dy: int, *, pixel: int = FINE, noise: float = 1.5, seed: int = 0) -> np.ndarray:
    """An image of `pixel` known pixels to one, the camera moved by (dx, dy) known pixels, blurred by the same lens."""
    blurred = cv2.GaussianBlur(known.astype(np.float32), (0, 0), LENS_BLUR_PX * FINE)
    left, top = 2 * FINE + dx, 2 * FINE + dy
    window = blurred[top : top + SIZE[0] * FINE, left : left + SIZE[1] * FINE]
    image = cv2.resize(window, (SIZE[1] * FINE // pixel, SIZE[0] * FINE // pixel), interpolation=cv2.INTER_AREA)
    return np.clip(np.rint(image + np.random.default_rng(seed).normal(0, noise, image.shape)), 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def images(known):
    return [seen(known, dx, dy, seed=i) for i, (dx, dy) in enumerate(SHIFTS)]


def rms(a: np.ndarray, b: np.ndarray) -> float:
    inner = slice(8, -8)  # what lies beyond an image's edge is known to none
    return float(np.sqrt(np.mean((a[inner, inner].astype(float) - b[inner, inner]) ** 2)))


@pytest.mark.parametrize("shift", SHIFTS)
def test_shifts_are_registered_to_a_twentieth_of_a_pixel(known, images, shift):
    found = registration(images[0], seen(known, *shift, seed=9))
    middle = np.array([SIZE[1] / 2, SIZE[0] / 2, 1])
    np.testing.assert_allclose(found @ middle - middle[:2], -np.array(shift) / FINE, atol=REGISTRATION_PX)


def test_super_resolution_is_nearer_to_the_truth_than_one_enlarged_image(known, images):
    truth = cv2.resize(known, ((SIZE[1] + 4) * FACTOR, (SIZE[0] + 4) * FACTOR), interpolation=cv2.INTER_AREA)
    truth = truth[2 * FACTOR : -2 * FACTOR, 2 * FACTOR : -2 * FACTOR]
    found = super_resolve_images(images).image
    enlarged = cv2.resize(images[0], found.shape[1::-1], interpolation=cv2.INTER_CUBIC)
    assert found.shape == truth.shape
    assert rms(found, truth) < MAX_ERROR_RATIO * rms(enlarged, truth)


def test_the_super_resolved_picture_is_aligned_with_the_first_image(images):
    found = super_resolve_images(images).image
    again = cv2.resize(found, SIZE[::-1], interpolation=cv2.INTER_AREA)
    moved = registration(images[0], again)
    middle = np.array([SIZE[1] / 2, SIZE[0] / 2, 1])
    np.testing.assert_allclose(moved @ middle, middle[:2], atol=REGISTRATION_PX)


def test_ink_has_no_halo(known, images):
    darker = [(image * 0.8).astype(np.uint8) for image in images]  # paper at 204: what is brighter can be seen
    paper = int(np.mean([np.percentile(image, 90) for image in darker]))
    assert np.percentile(super_resolve_images(darker).image, 99) <= paper + MAX_OVERSHOOT


def test_a_uniform_picture_stays_uniform():
    rng = np.random.default_rng(1)
    texture = cv2.GaussianBlur(rng.normal(0, 40, (*SIZE, 3)), (0, 0), 6) * 5  # something to register by
    images = [np.clip(120 + np.roll(texture, k, axis=(0, 1)), 0, 255).astype(np.uint8) for k in (0, 0, 0, 0)]
    with pytest.raises(BadInput, match="on each other"):
        super_resolve_images(images)


def test_too_few_shots_are_rejected(images):
    with pytest.raises(BadInput, match="too few"):
        super_resolve_images(images[:3])


def test_shots_of_different_sizes_are_rejected(images):
    with pytest.raises(BadInput, match="sizes"):
        super_resolve_images([*images[:4], images[4][:-1]])


@pytest.mark.parametrize("other", ["another page", "black", "mirrored"])
def test_a_shot_of_another_page_is_rejected(images, other):
    rng = np.random.default_rng(2)
    pictures = {
        "another page": rng.integers(0, 255, (*SIZE, 3)).astype(np.uint8),
        "black": np.zeros((*SIZE, 3), np.uint8),
        "mirrored": np.ascontiguousarray(images[0][:, ::-1]),
    }
    with pytest.raises(BadInput, match="capture 5 does not show the same page"):
        super_resolve_images([*images[:4], pictures[other]])


def test_a_shot_with_a_large_shift_is_rejected(images, known):
    far = [seen(known, 0, 0), *images[1:4], np.roll(images[0], 5, axis=1)]
    with pytest.raises(BadInput, match="moved by"):
        super_resolve_images(far)


def test_texture_positions_of_a_scan_are_scaled_to_the_super_resolved_picture(images):
    rows, cols = SIZE
    points = np.zeros((rows, cols, 3))
    grid = np.stack(np.meshgrid(np.arange(cols), np.arange(rows)), axis=-1).astype(float)
    shots = [RangeScan(points, image, grid, {"lens": "MIDDLE"}) for image in images]
    scan = super_resolve(shots)
    assert scan.points is points
    assert scan.texture.shape == (rows * FACTOR, cols * FACTOR, 3)
    np.testing.assert_array_equal(scan.texture_xy[0, 0], [(FACTOR - 1) / 2] * 2)  # the middle of its finer pixels
    assert scan.provenance["lens"] == "MIDDLE"
    assert scan.provenance["super_resolution"]["captures"] == len(images)
    with pytest.raises(BadInput, match="no colour"):
        super_resolve([*shots, RangeScan(points, None, grid)])
