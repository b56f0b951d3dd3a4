"""Photographs are registered to a fraction of their pixels, or refused with the reason."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from drivers.simulated import Text
from oracles.simulation.camera import Exposure
from oracles.studio import LIMIT_PX, SHEETS, reprojection_errors, scan_page, take_photograph
from restore import Photograph
from restore.photo.blur import relative_blur
from restore.photo.register import AGAIN, Refused, _insist, register

pytestmark = pytest.mark.slow

# Shifts are measured to a tenth of the scanner's pixels, which are two or three of the photograph's, at hundreds of
# places; what is left is the scanner's own noise.
RMS_PX = 0.5
OWN_BLUR_PX = Exposure().blur_px
BLUR_PX, BLUR_FRACTION = 0.25, 0.2  # blurs are tried in steps of a quarter and less
FOCAL = 0.03  # a page that hardly bends tells the focal length no better, nor does its place depend on it


def rms(off):
    return float(np.sqrt(np.mean(off**2)))


@pytest.mark.parametrize(
    ("studio", "view"),
    [("text", "above"), ("text", "from the left"), ("text", "phone, held upright"), ("figure", "from the left")],
)
def test_a_photograph_with_distortion_blur_noise_and_another_light(studio, view, request):
    studio = request.getfixturevalue(studio)
    found, camera = studio.registered(view), studio.camera(view)
    off = reprojection_errors(studio.page, studio.truth, camera, found)
    assert RMS_PX < LIMIT_PX
    assert rms(off) < RMS_PX
    assert found.camera.focal_px == pytest.approx(camera.focal_px, rel=FOCAL)
    assert found.coverage > 0.9
    # What it says of itself is no flattery.
    assert found.uncertainty_px > 0.1 * rms(off)


def test_the_measure_can_fail(text):
    found, camera = text.registered(), text.camera()
    moved = found.camera.vector.copy()
    moved[3] += 3.0
    worse = type(found)(type(found.camera)(moved, found.camera.size), 0, 0, 1, 1, 1)
    assert rms(reprojection_errors(text.page, text.truth, camera, worse)) > 3 * LIMIT_PX


def test_a_part_of_the_page_is_registered_too(text):
    image, camera = text.photograph(), text.camera()
    top, left = 160, 240
    found = register(text.reference, Photograph(np.ascontiguousarray(image[top:640, left:880])))
    whole = found.camera.project(text.page.vertices) + [left, top] - camera.project(text.page.vertices)
    seen = (np.abs(found.camera.project(text.page.vertices) - [320, 240]) < [320, 240]).all(axis=1)
    assert 0.15 < found.coverage < 0.6
    assert rms(whole[seen]) < LIMIT_PX


def test_a_focal_length_from_exif_may_be_wrong(text):
    image, camera = text.photograph(), text.camera()
    found = register(text.reference, Photograph(image, focal_px=camera.focal_px * 1.5))
    assert rms(reprojection_errors(text.page, text.truth, camera, found)) < LIMIT_PX


def refusal(reference, image):
    with pytest.raises(Refused) as refused:
        register(reference, Photograph(image))
    return str(refused.value)


def test_another_page_of_the_same_book_is_refused(text):
    other = take_photograph(scan_page(SHEETS["binding"], Text(seed=9))[0], text.camera())
    assert "does not show this page" in refusal(text.reference, other)


def test_a_mirrored_photograph_is_refused(text):
    assert "mirrored" in refusal(text.reference, np.ascontiguousarray(text.photograph()[:, ::-1]))


def test_a_black_or_empty_picture_is_refused(text, rng):
    assert "blank" in refusal(text.reference, np.zeros((600, 800, 3), np.uint8))
    noise = rng.normal(128, 12, (600, 800, 3)).clip(0, 255).astype(np.uint8)
    assert "does not show this page" in refusal(text.reference, noise)


def test_a_photograph_coarser_than_the_scanner_is_refused(text):
    small = cv2.resize(text.photograph(), (480, 320), interpolation=cv2.INTER_AREA)
    assert "coarser" in refusal(text.reference, small)


def test_a_photograph_more_blurred_than_the_scanner_s_image_is_refused(text):
    blurred = cv2.GaussianBlur(text.photograph(), (0, 0), 4.0)
    assert "blurred: print is spread by" in refusal(text.reference, blurred)


@pytest.mark.parametrize("sigma_px", [0.0, 2.0, 5.0])
def test_blur_is_measured_in_pixels_of_the_scanner_s_image(text, sigma_px):
    found = text.registered()
    blurred = cv2.GaussianBlur(text.photograph(), (0, 0), sigma_px) if sigma_px else text.photograph()
    measured = relative_blur(text.reference, cv2.cvtColor(blurred, cv2.COLOR_RGB2GRAY), found.camera)
    assert measured == pytest.approx(np.hypot(sigma_px, OWN_BLUR_PX) / found.scale, abs=BLUR_PX, rel=BLUR_FRACTION)


def test_print_in_one_corner_does_not_locate_the_page(text):
    """What is said is where the page may be, in millimetres of paper, and not a number of pixels that means nothing."""
    found = text.registered()
    for uncertain, words in ((400.0, "it may be anywhere"), (3.0 * found.scale, "mm off")):
        with pytest.raises(Refused, match="too little print") as refused:
            _insist(replace(found, uncertainty_px=uncertain), text.reference)
        assert words in str(refused.value)
        assert refused.value.hint == AGAIN


def test_a_page_that_was_bent_after_the_scan_is_refused(text):
    """The same print on a sheet that bends another way."""
    bent = take_photograph(scan_page(SHEETS["deep gutter"], Text())[0], text.camera())
    assert refusal(text.reference, bent)
