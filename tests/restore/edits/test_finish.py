"""A crop samples nothing again: its pixels are those of the page."""

from __future__ import annotations

import numpy as np
import pytest

from restore import NotEnoughSurface, PartEdits, Settings, SurfaceMesh, restore
from restore.edits.finish import crop_page, finish_page
from restore.edits.model import Crop

CORNERS = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 50.0, 0.0], [0.0, 50.0, 0.0]])
INCH_MM = 25.4


@pytest.fixture(scope="module")
def page():
    return restore(SurfaceMesh(CORNERS, np.array([[0, 1, 2], [0, 2, 3]])), Settings(dpi=30))


def test_a_box_is_a_part_of_the_page(page):
    box = crop_page(page, Crop(mode="box", box=(INCH_MM, 0.0, 2 * INCH_MM, INCH_MM)))
    np.testing.assert_array_equal(box.image, page.image[:30, 30:60])
    assert box.report["page_mm"] == pytest.approx([INCH_MM, INCH_MM])


def test_a_margin_is_white_and_off_the_page(page):
    wide = crop_page(page, Crop(mode="margin", margin_mm=INCH_MM))
    np.testing.assert_array_equal(wide.image[30:-30, 30:-30], page.image)
    assert (wide.image[:30] == 255).all() and not wide.mask[:30].any()


def test_without_corrections_the_page_is_as_it_was(page):
    assert finish_page(page, PartEdits()).image is page.image


def test_a_box_off_the_page_leaves_too_little(page):
    with pytest.raises(NotEnoughSurface, match="crop"):
        crop_page(page, Crop(mode="box", box=(200.0, 0.0, 300.0, 50.0)))
