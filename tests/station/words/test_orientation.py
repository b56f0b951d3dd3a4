"""Which way up a page is, by its words."""

from __future__ import annotations

import shutil
from dataclasses import replace

import font_source_sans_pro as typeface
import numpy as np
import pytest
from PIL import Image, ImageDraw, ImageFont

from station.choices import Rotation
from station.words.orientation import Upright, densest_part, turned, upright_turn
from station.words.words import ProgramMissing

DPI = 150.0
TEXT = "A scanner measures the surface of a warped page and the page is laid flat so that its words can be read again."

needs_tesseract = pytest.mark.skipif(shutil.which("tesseract") is None, reason="Tesseract is not installed")


@pytest.fixture(scope="module")
def printed():
    """A page of ten lines of 12 points."""
    picture = Image.new("RGB", (900, 600), "white")
    font = ImageFont.truetype(typeface.SourceSansPro, 25)
    words = TEXT.split()
    for line in range(12):
        text = " ".join(words[(5 * line + k) % len(words)] for k in range(10))
        ImageDraw.Draw(picture).text((60, 50 + 40 * line), text, font=font, fill="black")
    return np.asarray(picture)


@pytest.fixture(scope="module")
def few_lines(printed):
    return np.ascontiguousarray(printed[40:140])


@needs_tesseract
@pytest.mark.parametrize("degrees", [0, 90, 180, 270])
def test_words_determine_which_way_up_a_page_is(printed, degrees):
    lying = np.ascontiguousarray(np.rot90(printed, degrees // 90))  # counter-clockwise
    assert upright_turn(lying, DPI) == Upright(degrees)


@needs_tesseract
@pytest.mark.parametrize(("degrees", "mirrored"), [(90, False), (180, False), (0, True)])
def test_a_few_lines_are_read_in_every_direction_and_mirrored(few_lines, degrees, mirrored):
    """Too few for the detection of orientation."""
    lying = np.rot90(few_lines, degrees // 90)
    lying = np.ascontiguousarray(lying[:, ::-1] if mirrored else lying)
    assert upright_turn(lying, DPI) == Upright(degrees, mirrored)


@needs_tesseract
def test_a_page_whose_words_are_a_mirror_image_is_mirrored(page, few_lines):
    mirrored = replace(page.with_pictures(image=np.ascontiguousarray(few_lines[:, ::-1])), dpi=DPI)
    upright, findings = turned(mirrored, Rotation.AUTO)
    np.testing.assert_array_equal(upright.image, few_lines)
    assert [one.code for one in findings] == ["words_mirrored"]


def test_the_part_that_is_read_has_most_letters(printed):
    wide = np.full((2400, 3000, 3), 255, np.uint8)
    wide[1200:1800, 1500:2400] = printed
    part = densest_part(wide, DPI)
    assert max(part.shape[:2]) <= 2 * DPI + 8
    assert (part < 128).mean() > 0.8 * (printed[100:400, 100:400] < 128).mean()
    assert densest_part(np.full((300, 300, 3), 255, np.uint8), DPI) is None


@needs_tesseract
def test_a_page_of_words_is_turned_upright(page, printed):
    lying = replace(page.with_pictures(image=np.ascontiguousarray(np.rot90(printed))), dpi=DPI)
    upright, findings = turned(lying, Rotation.AUTO)
    np.testing.assert_array_equal(upright.image, printed)
    assert findings == ()


@needs_tesseract
def test_without_words_the_page_stays_with_a_finding(page):
    blank = page.with_pictures(image=np.full((300, 200, 3), 250, np.uint8))
    same, findings = turned(blank, Rotation.AUTO)
    assert same is blank
    assert [one.code for one in findings] == ["turn_undecided"]


def test_a_given_turn_needs_no_words(page):
    quarter, findings = turned(page, Rotation.QUARTER, which=lambda _: None)
    np.testing.assert_array_equal(quarter.image, np.rot90(page.image, -1))
    assert findings == ()


def test_auto_without_tesseract_is_refused(page):
    with pytest.raises(ProgramMissing):
        turned(page, Rotation.AUTO, which=lambda _: None)
