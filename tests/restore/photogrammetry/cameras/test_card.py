"""The scale card is found in photographs to a fraction of a pixel."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from restore.photogrammetry.cameras.card import SCALE_CARD, crossing_of_diagonals, detect_markers, outline_in

DPI = 177.8  # seven pixels to a millimetre: every edge of the card falls between two
ACCURACY_PX = 0.05  # of a centre in a sharp picture with noise of two codes
NOISE_CODES = 2.0
OUTLINE_PX = 0.5  # a corner lies half a marker beyond the markers' centres


def photographed(homography, size=(1400, 1000), *, blur=0.8, seed=1):
    """(h, w, 3) uint8: the card through a homography (3, 3) from its picture, and the centres (n, 2) it has there."""
    picture = SCALE_CARD.picture(DPI)
    grey = cv2.warpPerspective(picture, homography, size, flags=cv2.INTER_AREA, borderValue=90).astype(np.float32)
    grey = cv2.GaussianBlur(grey, (0, 0), blur) + np.random.default_rng(seed).normal(0, NOISE_CODES, grey.shape)
    centres = (SCALE_CARD.centres * [1, -1] + np.array(SCALE_CARD.size_mm) / 2) * DPI / 25.4 - 0.5
    seen = cv2.perspectiveTransform(centres[None], homography)[0]
    return np.repeat(np.clip(np.rint(grey), 0, 255).astype(np.uint8)[..., None], 3, axis=2), seen


@pytest.mark.parametrize("blur", [0.6, 1.5])
def test_centres_are_found_in_perspective(blur):
    homography = np.array([[0.75, 0.17, 150.0], [-0.13, 0.6, 350.0], [1e-4, -1.3e-4, 1.0]])
    image, expected = photographed(homography, blur=blur)
    found = detect_markers(image)
    assert sorted(found) == list(range(12))
    error = np.array([found[number] - expected[number] for number in found])
    assert np.sqrt((error**2).sum(axis=1).mean()) < ACCURACY_PX


def test_a_large_photograph_is_as_exact_as_a_small_one():
    homography = np.array([[2.4, 0.2, 200.0], [-0.27, 2.2, 900.0], [3.4e-5, -4e-5, 1.0]])
    image, expected = photographed(homography, (4400, 3000))
    found = detect_markers(image)
    assert len(found) == 12
    assert max(np.linalg.norm(found[number] - expected[number]) for number in found) < 3 * ACCURACY_PX


def test_a_mirrored_card_is_not_found():
    image, _ = photographed(np.array([[0.75, 0.0, 150.0], [0.0, 0.75, 350.0], [0, 0, 1.0]]))
    assert detect_markers(np.ascontiguousarray(image[:, ::-1])) == {}


def test_markers_of_two_cards_are_left_out():
    image, _ = photographed(np.array([[0.7, 0.0, 150.0], [0.0, 0.7, 100.0], [0, 0, 1.0]]))
    other, _ = photographed(np.array([[0.7, 0.0, 150.0], [0.0, 0.7, 600.0], [0, 0, 1.0]]))
    image[500:] = other[500:]
    assert detect_markers(image) == {}


def test_diagonals_cross_where_the_projected_centre_is():
    square = np.array([[-1.0, 1], [1, 1], [1, -1], [-1, -1]])
    homography = np.array([[2.0, 0.3, 5.0], [-0.1, 1.5, 7.0], [0.1, 0.2, 1.0]])
    corners = cv2.perspectiveTransform(square[None], homography)[0]
    np.testing.assert_allclose(crossing_of_diagonals(corners), [5.0, 7.0], atol=1e-12)


def test_the_outline_encloses_the_markers():
    reach = np.abs(SCALE_CARD.centres).max(axis=0) + SCALE_CARD.marker_mm / 2 + SCALE_CARD.margin_mm
    np.testing.assert_allclose(np.abs(SCALE_CARD.hull(range(12))), np.tile(reach, (4, 1)), atol=1e-5)
    np.testing.assert_allclose(SCALE_CARD.outline.max(axis=0), reach)
    np.testing.assert_allclose(SCALE_CARD.size_mm, 2 * reach)


def test_the_hull_of_some_markers_is_the_paper_round_them():
    hull = SCALE_CARD.hull([6])
    reach = SCALE_CARD.marker_mm / 2 + SCALE_CARD.margin_mm
    np.testing.assert_allclose(np.abs(hull - SCALE_CARD.centres[6]), reach, atol=1e-5)


@pytest.mark.parametrize("seen", [range(12), (0, 1, 2, 6, 7)])
def test_the_outline_in_a_photograph_is_that_of_the_markers_seen(seen):
    homography = np.array([[0.75, 0.17, 150.0], [-0.13, 0.6, 350.0], [1e-4, -1.3e-4, 1.0]])
    image, _ = photographed(homography)
    corners = (SCALE_CARD.hull(seen) * [1, -1] + np.array(SCALE_CARD.size_mm) / 2) * DPI / 25.4 - 0.5
    expected = cv2.perspectiveTransform(corners[None], homography)[0]
    markers = detect_markers(image)
    np.testing.assert_allclose(outline_in({m: markers[m] for m in seen}), expected, atol=OUTLINE_PX)


def test_three_markers_give_no_outline():
    assert outline_in({number: np.array([10.0 * number, 5.0]) for number in range(3)}) is None
