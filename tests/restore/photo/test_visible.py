"""What a camera does not see is not painted from it."""

import cv2
import numpy as np
import pytest

from restore.camera.photo_camera import PhotoCamera
from restore.photo.visible import clipped_fraction, glare_mask, visible_points

SIZE = (400, 300)


def camera_at(place, towards=(0.0, 0.0, -900.0)):
    """A camera that looks along the scanner's axis or aside from it, upright."""
    forward = np.asarray(towards, float) - place
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 1.0, 0])
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(forward, right), forward])
    turn = cv2.Rodrigues(axes)[0].ravel()
    lens = [500.0, 199.5, 149.5, 0, 0, 0, 0, 0]
    return PhotoCamera(np.concatenate([turn, -axes @ np.asarray(place, float), lens]), SIZE)


def strip(left, right, depth, shift=0):
    """A rectangle 200 mm high at a depth: vertices (4, 3) and faces (2, 3) towards the scanner."""
    vertices = np.array([[left, -100, depth], [right, -100, depth], [right, 100, depth], [left, 100, depth]], float)
    return vertices, np.array([[0, 1, 2], [0, 2, 3]]) + shift


@pytest.fixture
def step():
    """A page with a flap over its right half, 40 mm above it."""
    (low, low_faces), (high, high_faces) = strip(-100, 100, -900.0), strip(20, 100, -860.0, 4)
    return np.concatenate([low, high]), np.concatenate([low_faces, high_faces])


def up(points):
    return np.tile([0.0, 0.0, 1.0], (len(points), 1))


def test_a_flap_hides_what_lies_behind_it(step):
    points = np.array([[-50.0, 0, -900], [10, 0, -900], [60, 0, -900], [60, 0, -860]])
    from_above = visible_points(camera_at([0, 0, -400.0]), *step, points, up(points))
    np.testing.assert_array_equal(from_above, [True, True, False, True])
    from_the_right = visible_points(camera_at([400.0, 0, -500.0]), *step, points, up(points))
    np.testing.assert_array_equal(from_the_right, [True, False, False, True])


def test_from_behind_from_the_side_and_past_the_frame(step):
    points = np.array([[-50.0, 0, -900]])
    assert not visible_points(camera_at([0, 0, -1400.0]), *step, points, up(points))[0]
    assert not visible_points(camera_at([-900.0, 0, -860.0]), *step, points, up(points))[0]
    assert not visible_points(camera_at([0, 0, -400.0], towards=(300, 0, -900)), *step, points, up(points))[0]


def spots():
    """Light of a page with a dark figure, as the scanner sees it, and where both see it."""
    expected = np.full((60, 80), 0.8)
    expected[30:50, 10:30] = 0.05
    return expected, np.ones((60, 80), bool)


def test_a_glare_is_found_with_its_haze_and_on_dark_ink():
    expected, seen = spots()
    rows, cols = np.mgrid[:60, :80]
    shine = 0.9 * np.exp(-((rows - 25) ** 2 + (cols - 30) ** 2) / 2 / 5.0**2)
    light = 0.7 * expected + shine
    found = glare_mask((light >= 0.95).astype(float), np.minimum(light, 1.0), expected, seen, 25.0)
    assert found[shine > 0.3].all()
    assert not found[shine < 0.002].any()


def test_overexposed_paper_and_another_light_are_not_glare():
    expected, seen = spots()
    full = np.minimum(1.5 * expected, 1.0)
    assert not glare_mask((full >= 0.95).astype(float), full, expected, seen, 25.0).any()
    slanted = expected * np.linspace(0.4, 1.0, 80)
    assert not glare_mask((slanted >= 0.95).astype(float), slanted, expected, seen, 25.0).any()


def test_ink_is_not_glare_where_another_picture_shows_it_less_sharply():
    expected, seen = np.full((60, 80), 0.8), np.ones((60, 80), bool)
    expected[20:40:4, 10:70] = 0.02
    blurred = cv2.GaussianBlur(expected, (0, 0), 1.0)
    assert (blurred > 3 * expected).any()  # as much lighter as a lamp would make ink
    assert not glare_mask(np.zeros((60, 80)), blurred, expected, seen, 25.0).any()


def test_clipped_fraction():
    image = np.full((40, 40, 3), 200, np.uint8)
    image[:20] = 255
    image[20:, :, 0] = 255  # a red that is full is a colour
    np.testing.assert_allclose(clipped_fraction(image, (2, 2)), [[1, 1], [0, 0]])
