"""A page painted from a photograph and the scanner's image, each by its own light, comes out as by one even light."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from oracles.simulation.camera import Exposure
from oracles.studio import View
from restore import Photograph
from restore.photo import Registered, paint_registered, register_photographs, remove_registered_shading
from restore.photo.shading import _report
from restore.prepared.prepare import prepare
from restore.shading.relief import relief_of
from restore.shading.remove import LIGHT_DPI, LINEAR, ShadingResult, find_light
from restore.texture.page import paint_page

DPI = 80.0
EVEN_LIGHT = Exposure(ambient=1.0, falloff=0.0, noise=0.0, colour=(1.0, 1.0, 1.0))
PAPER_FRACTION = 0.98  # in the truth, of the codes of bare paper, which is a third of the page; its edges are greyer
LIT = 0.25  # of the light: what lamp and folds do to nine tenths of the paper, more than that
LEFT = 0.06  # of it after: the noise of two pictures, 1.5 % rms each, and the edges of folds
LEVEL = 0.02  # by so much two parts of a page may differ; the eye sees no step that small across 3 mm


@pytest.fixture(scope="module")
def close_up(figure):
    """A close photograph that shows a part of the page."""
    near = View((-60.0, 40.0, 300.0), 1.45, 0.0, -0.1, 0.0)
    return register_photographs(figure.page, [figure.photograph(near)])


@pytest.fixture(scope="module")
def truth(figure):
    """The page as another camera, that saw all of it, would have it in even light."""
    found = figure.registered("above")
    unlit = Registered(Photograph(figure.photograph("above", EVEN_LIGHT)), found)
    return paint_registered(figure.page, [unlit], DPI)[0].image


@pytest.fixture(scope="module")
def relief(figure):
    return relief_of(figure.page, prepare(figure.scan).normals_on, LIGHT_DPI)


def light_on(image, truth, where):
    """(n,) light on paper over that of the truth."""
    return LINEAR[image[where]].mean(axis=1) / LINEAR[truth[where]].mean(axis=1)


def spread(light):
    low, middle, high = np.percentile(light, [5, 50, 95])
    return (high - low) / middle


@pytest.mark.slow
def test_every_picture_loses_its_own_light(figure, close_up, truth, relief):
    painting, (reported,) = paint_registered(figure.page, close_up, DPI)
    assert 0.2 < reported["textured_fraction"] < 0.9
    darkest = truth.min(axis=2)
    paper = painting.mask & (darkest > PAPER_FRACTION * np.percentile(darkest[painting.mask], 80))
    paper = cv2.erode(paper.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    cells, _ = paint_registered(figure.page, close_up, LIGHT_DPI)
    evened = remove_registered_shading(figure.page, close_up, relief, cells, painting, DPI)
    together = find_light(cells.image, cells.mask, relief).removed_from(painting.image, painting.mask, DPI)
    pages = painting.image, evened.image, together.image
    before, after, mixed = (spread(light_on(page, truth, paper)) for page in pages)
    assert before > LIT
    assert after < LEFT
    assert after < mixed
    of_photo, of_scanner = (
        np.median(light_on(evened.image, truth, paper & (painting.page_source == source))) for source in (1, 0)
    )
    assert of_scanner == pytest.approx(of_photo, rel=LEVEL)
    np.testing.assert_array_equal(evened.image[~painting.mask], painting.image[~painting.mask])


@pytest.mark.slow
def test_one_picture_alone_is_evened_as_it_is(figure, relief):
    plain, cells = (paint_page(figure.page, dpi) for dpi in (DPI, LIGHT_DPI))
    refused = Registered(Photograph(np.zeros((9, 9, 3), np.uint8)), None, "no")
    light = find_light(cells.image, cells.mask, relief)
    for outcome in ([], [refused]):
        evened = remove_registered_shading(figure.page, outcome, relief, cells, plain, DPI)
        np.testing.assert_array_equal(evened.image, light.removed_from(plain.image, plain.mask, DPI).image)


@pytest.mark.slow
def test_a_page_without_picture_stays(figure, relief):
    bare = replace(figure.page, texture=None, texcoords=None)
    plain, cells = (paint_page(figure.page, dpi) for dpi in (DPI, LIGHT_DPI))
    evened = remove_registered_shading(bare, [], relief, cells, plain, DPI)
    assert evened.image.shape == plain.image.shape


def test_a_picture_whose_light_was_kept_is_reported():
    reported = ShadingResult(np.zeros((2, 2, 3), np.uint8), {"removed": True, "lamps": 1})
    kept = ShadingResult(np.zeros((2, 2, 3), np.uint8), {"removed": False, "reason": "nothing is certain"})
    assert _report({0: reported, 1: reported}, 1) == reported.report
    report = _report({0: reported, 1: kept}, 0)
    assert not report["removed"]
    assert report["reason"] == "nothing is certain (in photograph 1)"
