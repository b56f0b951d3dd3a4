"""A crop samples nothing again: its pixels are those of the page."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from restore import NotEnoughSurface, PartEdits, Settings, SurfaceMesh, restore, rotate_page
from restore.edits.finish import crop_page, finish_page, size_before_rotation
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


def test_the_master_keeps_what_is_cropped(page):
    box = crop_page(page, Crop(mode="box", box=(INCH_MM, 0.0, 2 * INCH_MM, INCH_MM)))
    assert page.uncropped is None
    assert box.uncropped is page.master
    assert crop_page(box, Crop(mode="margin", margin_mm=1.0)).uncropped is page.master
    assert rotate_page(box, 90).uncropped.shape == page.master.shape[1::-1] + (3,)


def test_a_margin_is_white_and_off_the_page(page):
    wide = crop_page(page, Crop(mode="margin", margin_mm=INCH_MM))
    np.testing.assert_array_equal(wide.image[30:-30, 30:-30], page.image)
    assert (wide.image[:30] == 255).all() and not wide.mask[:30].any()


def test_without_corrections_the_page_is_as_it_was(page):
    assert finish_page(page, PartEdits()).image is page.image


def test_a_box_off_the_page_leaves_too_little(page):
    with pytest.raises(NotEnoughSurface, match="crop"):
        crop_page(page, Crop(mode="box", box=(200.0, 0.0, 300.0, 50.0)))


@pytest.mark.parametrize("degrees", [-20.0, 0.0, 1.5, 29.0])
def test_a_page_that_was_rotated_by_hand_has_the_size_that_it_had(page, degrees):
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turned = page.changed_meshes(lambda mesh: replace(mesh, flat=mesh.flat @ np.array([[cos, -sin], [sin, cos]])))
    assert size_before_rotation(turned, degrees) == pytest.approx((100.0, 50.0))


def test_a_size_is_that_of_the_page_as_it_is_read(page):
    turned = finish_page(page, PartEdits(turn=1, size_mm=(50.0, 100.0)))
    assert not [one for one in turned.findings if one.code.startswith("size_")]
    other = finish_page(page, PartEdits(size_mm=(100.0, 54.0)))
    assert [one.code for one in other.findings if one not in page.findings] == ["size_differs"]
    assert other.report["findings"] == [one.as_json() for one in other.findings]
    assert other.image is page.image
