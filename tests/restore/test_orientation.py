"""A page is turned and mirrored with all its images, maps and meshes."""

from dataclasses import replace

import numpy as np
import pytest

from restore.findings import Finding
from restore.mesh.measures import signed_areas
from restore.orientation import mirror_page, rotate_page
from restore.texture.page import page_map

ROUNDING = 1e-4  # pixels of the texture: float32 of the page map
FIELDS = ("image", "mask", "page_map", "master", "coverage")


@pytest.fixture
def page(random_page):
    return random_page


def test_a_quarter_brings_the_left_side_up(page):
    right = rotate_page(page, 90)
    np.testing.assert_array_equal(right.image[0], page.image[::-1, 0])
    assert right.report["page_mm"] == page.report["page_mm"][::-1]
    assert right.report["rotation_deg"] == 90


@pytest.mark.parametrize("degrees", [0, 90, 180, 270])
def test_the_mesh_is_turned_with_the_map(page, degrees):
    """The map of the turned mesh is the turned map."""
    done = rotate_page(page, degrees)
    again = page_map(done.fine.flat, done.fine.faces, done.fine.texcoords, done.dpi)
    np.testing.assert_array_equal(np.isnan(again), np.isnan(done.page_map))
    np.testing.assert_allclose(again, done.page_map, atol=ROUNDING)


@pytest.mark.parametrize("degrees", [90, 180, 270])
def test_turned_on_to_a_full_turn_it_is_the_page_itself(page, degrees):
    back = rotate_page(rotate_page(page, degrees), 360 - degrees)
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(back, name), getattr(page, name))
    np.testing.assert_array_equal(back.flat.flat, page.flat.flat)
    np.testing.assert_array_equal(back.fine.flat, page.fine.flat)
    assert back.report == page.report


@pytest.mark.parametrize(("first", "second", "both"), [(90, 90, 180), (180, 90, 270), (270, 180, 90)])
def test_turned_twice_it_is_as_turned_once_by_both(page, first, second, both):
    twice, once = rotate_page(rotate_page(page, first), second), rotate_page(page, both)
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(twice, name), getattr(once, name))
    np.testing.assert_array_equal(twice.fine.flat, once.fine.flat)
    assert twice.report == once.report and once.report["rotation_deg"] == both


@pytest.mark.parametrize("degrees", [90, 180, 270])
def test_the_place_in_the_report_is_turned_with_the_mesh(page, degrees):
    at = np.array(page.report["strain"]["chord_strain"]["max_difference_at_mm"])
    now = rotate_page(page, degrees)
    nearest = np.linalg.norm(page.fine.flat - at, axis=1)
    turned = np.linalg.norm(now.fine.flat - now.report["strain"]["chord_strain"]["max_difference_at_mm"], axis=1)
    np.testing.assert_allclose(turned, nearest, atol=ROUNDING)


def test_pictures_that_are_not_there_stay_away(page):
    pictures = {name: rows for name, rows in page.pictures.items() if name != "page_source"}
    assert rotate_page(replace(page, pictures=pictures), 90).page_source is None


@pytest.mark.parametrize("degrees", [45, -90, 360])
def test_other_angles_are_refused(page, degrees):
    with pytest.raises(ValueError, match="right angle"):
        rotate_page(page, degrees)


def test_left_becomes_right(page):
    mirrored = mirror_page(page)
    np.testing.assert_array_equal(mirrored.image, page.image[:, ::-1])
    assert mirrored.report["page_mm"] == page.report["page_mm"]
    assert mirrored.report["mirrored"] is True


def test_the_mesh_is_mirrored_with_the_map(page):
    """The map of the mirrored mesh is the mirrored map, and its faces are not inverted."""
    done = mirror_page(page)
    again = page_map(done.fine.flat, done.fine.faces, done.fine.texcoords, done.dpi)
    np.testing.assert_array_equal(np.isnan(again), np.isnan(done.page_map))
    np.testing.assert_allclose(again, done.page_map, atol=ROUNDING)
    assert (signed_areas(done.fine.flat, done.fine.faces) > 0.0).all()
    np.testing.assert_array_equal(done.fine.edges, page.fine.edges)


@pytest.mark.parametrize("degrees", [0, 90, 180, 270])
def test_mirrored_twice_it_is_the_page_itself(page, degrees):
    turned = rotate_page(page, degrees)
    back = mirror_page(mirror_page(turned))
    for name in turned.pictures:
        np.testing.assert_array_equal(getattr(back, name), getattr(turned, name))
    np.testing.assert_array_equal(back.fine.flat, turned.fine.flat)
    np.testing.assert_array_equal(back.fine.faces, turned.fine.faces)
    assert back.report == turned.report


def test_it_may_no_longer_be_mirrored(page):
    found = (Finding.of("mirrored"), Finding.of("no_colour"))
    mirrored = mirror_page(replace(page, findings=found))
    assert [one.code for one in mirrored.findings] == ["no_colour"]
    assert Finding.all_in(mirrored.report) == mirrored.findings
