"""The page is painted from photographs, and from the scanner's image where none is good."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from oracles.simulation.camera import Exposure
from oracles.studio import VIEWS, View
from restore import CoverageClass, Photograph, Settings, restore
from restore.photo import Registered, paint_registered, register_photographs
from restore.photo.paint import NOWHERE, _carry_to_edge
from restore.texture.page import paint_page

pytestmark = pytest.mark.slow

DPI = 100.0
LIMIT_PX = 0.5  # rms; the limit of registration is 1.5
FINER = 2.0  # times: 138 against 55 pixels per inch
STEEPER = 1.1  # times: page pixels of 100 dpi take off most of it
SAME_PPI = 0.02  # of two measurements by cameras that are one but for rounding
HALF = 0.6  # of the pixels: a blur of 2 pixels upon one of 0.7 leaves a third
TABLE, PAPER = 60, 100  # codes: the table is darker than that, the paper brighter, in every photograph here
FULL = 250
SEAM_CODES = 1.0  # a pixel: a step would be ten and more, the two pictures have another light


@pytest.fixture(scope="module")
def painted(text):
    return paint_registered(text.page, register_photographs(text.page, [text.photograph()]), DPI)


@pytest.fixture(scope="module")
def plain(text):
    return paint_page(text.page, DPI)


def test_a_camera_that_is_known_is_taken_at_its_word(text):
    known = Photograph(np.full((30, 40, 3), 128, np.uint8), "blank", camera=text.camera())
    (one,) = register_photographs(text.page, [known])
    assert one.registration.camera is known.camera


def test_what_a_photograph_of_a_known_camera_resolves_is_measured(text, painted):
    image = text.photograph()
    known = Photograph(image, "known", camera=text.registered().camera)
    _, (report,) = paint_registered(text.page, register_photographs(text.page, [known]), DPI)
    assert "resolved_ppi_unknown" not in report
    assert report["resolved_ppi"] == pytest.approx(painted[1][0]["resolved_ppi"], rel=SAME_PPI)
    blurred = replace(known, image=cv2.GaussianBlur(image, (0, 0), 2.0))
    _, (worse,) = paint_registered(text.page, register_photographs(text.page, [blurred]), DPI)
    assert worse["resolved_ppi"] < HALF * report["resolved_ppi"]


def test_every_pixel_comes_from_where_its_map_says(text, painted, plain):
    painting, (report,) = painted
    from_photo = painting.page_source == 1
    assert from_photo.mean() > 0.95
    assert report["textured_fraction"] > 0.95
    np.testing.assert_array_equal(painting.page_source == NOWHERE, ~painting.mask)
    # The scanner's pixel of the same place, its exact surface point, and that through the exact camera.
    rows, cols = np.nonzero(from_photo & plain.mask)
    at = plain.source()[rows, cols][:, ::-1].T
    points = np.stack([map_coordinates(text.truth.points[..., k], at, order=1) for k in range(3)], axis=1)
    off = np.linalg.norm(text.camera().project(points) - painting.source()[rows, cols], axis=1)
    assert np.sqrt(np.nanmean(off**2)) < LIMIT_PX


def test_the_page_shows_no_table_along_its_edge(painted):
    painting = painted[0]
    inner = cv2.erode(painting.mask.astype(np.uint8), np.ones((5, 5)), borderType=cv2.BORDER_CONSTANT, borderValue=0)
    edge = painting.mask & (inner == 0)
    assert (painting.image[edge].max(axis=1) < PAPER).mean() < 0.01


@pytest.fixture(scope="module")
def close_up(figure):
    """A close camera sees a part of the page; where that ends there is paper and picture."""
    near = View((-60.0, 40.0, 300.0), 1.45, 0.0, -0.1, 0.0)
    return paint_registered(figure.page, register_photographs(figure.page, [figure.photograph(near)]), DPI)


def test_where_a_photograph_ends_the_scanner_goes_on_without_a_seam(close_up):
    painting, (report,) = close_up
    assert report["accepted"]
    assert 0.2 < report["textured_fraction"] < 0.9
    seam = cv2.morphologyEx((painting.page_source == 1).astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3)))
    inner = cv2.erode(painting.mask.astype(np.uint8), np.ones((41, 41)))
    calm = cv2.GaussianBlur(painting.image, (0, 0), 3.0).mean(axis=2)
    steps = np.hypot(*np.gradient(calm))
    assert np.median(steps[(seam & inner) > 0]) < np.median(steps[inner > 0]) + SEAM_CODES


def test_ink_has_steeper_edges_than_the_scanner_gives_it(figure, close_up):
    painting, (report,) = close_up
    plain = paint_page(figure.page, DPI)
    inner = cv2.erode((painting.page_source == 1).astype(np.uint8), np.ones((15, 15))) > 0
    steepest = []
    for image in (painting.image, plain.image):
        grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) / np.percentile(image[inner], 90)
        steepest.append(np.percentile(np.hypot(*np.gradient(grey))[inner], 99.5))
    assert steepest[0] > STEEPER * steepest[1]
    assert report["sampling_ppi"] > FINER * plain.resolution.sampling_ppi


def test_two_photographs_by_different_light_make_one_page(text):
    left = View((-90.0, 0.0, 330.0), 1.45, 0.0, -0.1, 0.0)
    right = View((90.0, 0.0, 330.0), 1.45, 0.0, 0.05, 0.0)
    cold = Exposure(lamp=np.array([-0.5, 0.2, 0.8]), colour=(0.8, 0.9, 1.0), exposure=0.6)
    outcome = register_photographs(text.page, [text.photograph(left), text.photograph(right, cold)])
    painting, reports = paint_registered(text.page, outcome, DPI)
    assert all(0.2 < report["textured_fraction"] < 0.8 for report in reports)
    paper = painting.image[painting.mask & (painting.image.min(axis=2) > 120)].astype(float)
    tint = np.percentile(paper[:, 0] / paper[:, 2], [5, 95])
    assert np.ptp(tint) < 0.12  # one light; those of the two photographs differ by 0.2


def test_a_glare_is_painted_from_the_other_photograph_or_the_scanner(text):
    lamp = Exposure(lamp=np.array([0.0, 0.0, 1.0]), falloff=0.0)
    images = [text.photograph(view, lamp, gloss=1.0) for view in ("above", "from the left")]
    glare = (images[0].min(axis=2) >= FULL).mean()
    assert glare > 0.002
    outcome = register_photographs(text.page, images)
    for given in (outcome, outcome[:1]):
        painting, _ = paint_registered(text.page, given, DPI)
        assert ((painting.image.min(axis=2) >= FULL) & painting.mask).mean() < 0.25 * glare


SKIN = (188, 150, 130)  # codes
COVER_PX = 60  # radius of what lies on the page, in the photograph: 25 mm
MM2 = 300.0  # that is left out at least: a disc of 20 mm


@pytest.fixture(scope="module")
def thumbed(text):
    """A photograph with something round and skin-coloured over the print, and where."""
    image = text.photograph().copy()
    hidden = cv2.circle(np.zeros(image.shape[:2], np.uint8), (640, 420), COVER_PX, 1, -1) > 0
    image[hidden] = SKIN
    return image, hidden


def painted_from(source, page_source, number, hidden):
    """How many pixels of the page, their source (h, w, 2), are painted from a photograph where it is hidden."""
    at = np.nan_to_num(source[page_source == number], nan=0).round().astype(int)
    return int(hidden[at[:, 1], at[:, 0]].sum())


def test_what_covers_the_page_is_painted_from_the_scan_and_said(text, thumbed):
    image, hidden = thumbed
    page = restore(text.scan, Settings(dpi=DPI), photos=[Photograph(image, "thumb.jpg")])
    (report,) = page.report["photos"]
    assert report["accepted"]
    assert painted_from(page.page_map, page.page_source, 1, hidden) == 0
    assert report["obstructed_mm2"] > MM2
    assert page.report["coverage"]["obstructed"] == pytest.approx(report["obstructed_fraction"], rel=0.1)
    (found,) = page.report["findings"]
    assert found["text"].startswith("thumb.jpg: something obstructs the page")
    assert (page.coverage == CoverageClass.OBSTRUCTED).sum() > 0
    assert (page.page_source[page.coverage == CoverageClass.OBSTRUCTED] == 0).mean() > 0.9


def test_what_covers_the_page_in_one_photograph_is_painted_from_the_other(text, thumbed):
    image, hidden = thumbed
    outcome = register_photographs(text.page, [image, text.photograph("from the left")])
    painting, _ = paint_registered(text.page, outcome, DPI)
    assert painted_from(painting.source(), painting.page_source, 1, hidden) == 0
    assert (painting.page_source[painting.covered] == 2).mean() > 0.9


def test_what_lies_on_the_photograph_that_is_the_texture_is_not_painted_and_is_said_of_that_one_alone(text, thumbed):
    """As on a page from photographs alone."""
    image, hidden = thumbed
    images = {"above": image} | {view: text.photograph(view) for view in list(VIEWS)[1:]}
    cameras = {view: text.registered(view).camera for view in images}
    page = replace(text.page, texture=image, texcoords=cameras["above"].project(text.page.vertices))
    photos = [Photograph(images[view], view, camera=cameras[view]) for view in images]
    painting, reports = paint_registered(page, register_photographs(page, photos), DPI)
    assert sum(painted_from(painting.source(), painting.page_source, k, hidden) for k in (0, 1)) == 0
    assert reports[0]["obstructed_mm2"] > MM2
    assert [report["obstructed_mm2"] for report in reports[1:]] == [0.0, 0.0, 0.0]


def test_restore_counts_photographs_as_they_were_given_and_explains_a_refusal(text):
    photos = [np.zeros((300, 400, 3), np.uint8), Photograph(text.photograph(), "window.jpg")]
    page = restore(text.scan, Settings(dpi=DPI), photos=photos)
    assert set(np.unique(page.page_source)) <= {0, 2, NOWHERE}
    refused, used = page.report["photos"]
    assert refused == {"name": "photograph 1", "accepted": False, "reason": "the photograph is blank"}
    (found,) = page.report["findings"]
    assert found["text"].startswith("photograph 1 is not used: the photograph is blank; look at it")
    assert (used["name"], used["accepted"]) == ("window.jpg", True)
    assert used["residual_px"] < LIMIT_PX
    assert page.report["resolved_ppi"] == pytest.approx(used["resolved_ppi"], rel=0.02)
    assert used["resolved_ppi"] < used["sampling_ppi"]
    assert page.report["seconds"]["register"] > 0


def test_when_all_are_refused_the_page_is_the_scanner_s(text, plain):
    none = Registered(Photograph(np.zeros((9, 9, 3), np.uint8)), None, "no")
    painting, reports = paint_registered(text.page, [none], DPI)
    np.testing.assert_array_equal(painting.image, plain.image)
    assert painting.page_source is None
    assert reports == [{"name": "photograph", "accepted": False, "reason": "no"}]


def test_the_colour_inside_is_carried_to_the_edge():
    image, mask = np.zeros((20, 30, 3), np.uint8), np.zeros((20, 30), bool)
    mask[2:18, 3:27] = True
    image[mask] = TABLE
    image[5:15, 6:24] = 200
    _carry_to_edge(image, mask, 3)
    assert (image[mask] == 200).all()
    assert (image[~mask] == 0).all()


def test_a_strip_too_narrow_for_an_inside_stays_as_it_is(rng):
    image, mask = rng.integers(0, 256, (20, 30, 3), np.uint8), np.zeros((20, 30), bool)
    mask[4:8] = True
    before = image.copy()
    _carry_to_edge(image, mask, 3)
    np.testing.assert_array_equal(image, before)
