"""A page is mirrored with all its images, maps and meshes."""

from dataclasses import replace

import numpy as np
import pytest

from restore.findings import Finding
from restore.mesh.measures import signed_areas
from restore.mirror import mirror_page
from restore.page import IMAGES
from restore.texture.page import page_map
from restore.turn import rotate_page

ROUNDING = 1e-4  # pixels of the texture: float32 of the page map


@pytest.fixture
def page(random_page):
    return random_page


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
    for name in IMAGES:
        np.testing.assert_array_equal(getattr(back, name), getattr(turned, name))
    np.testing.assert_array_equal(back.fine.flat, turned.fine.flat)
    np.testing.assert_array_equal(back.fine.faces, turned.fine.faces)
    assert back.report == turned.report


def test_it_may_no_longer_be_mirrored(page):
    found = (Finding.of("mirrored"), Finding.of("no_colour"))
    mirrored = mirror_page(replace(page, findings=found))
    assert [one.code for one in mirrored.findings] == ["no_colour"]
    assert Finding.all_in(mirrored.report) == mirrored.findings
