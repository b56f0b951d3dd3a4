"""The model of a page lies where its picture does."""

from __future__ import annotations

import numpy as np
import pytest

from restore import RestoredPage, Settings, SurfaceMesh, mirror_page, restore, rotate_page
from restore.edits.finish import crop_page
from restore.edits.model import Crop
from station.page_files.model import page_uv

CORNERS = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 50.0, 0.0], [0.0, 50.0, 0.0]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])
DPI = 30
INCH_MM = 25.4


@pytest.fixture(scope="module")
def page() -> RestoredPage:
    """A page whose texture has one pixel for each millimetre."""
    texture = np.zeros((51, 101, 3), np.uint8)
    return restore(SurfaceMesh(CORNERS, FACES, texcoords=CORNERS[:, :2], texture=texture), Settings(dpi=DPI))


@pytest.mark.parametrize("degrees", [0, 90, 180, 270])
@pytest.mark.parametrize(
    "crop", [Crop(mode="margin", margin_mm=INCH_MM), Crop(mode="box", box=(INCH_MM, 10.0, 3 * INCH_MM, 40.0))]
)
def test_vertices_stay_at_their_places_on_the_picture(page, crop, degrees):
    """As the map of the page has them: of a pixel, the place on the sheet that is seen there."""
    cropped = rotate_page(crop_page(page, crop), degrees)
    for one in (cropped, mirror_page(cropped)):
        u, v = page_uv(one).T
        height, width = one.image.shape[:2]
        fit, *_ = np.linalg.lstsq(np.column_stack([u * width, (1 - v) * height, np.ones(len(u))]), one.fine.texcoords)
        rows, cols = np.nonzero(one.mask)
        seen = np.column_stack([cols + 0.5, rows + 0.5, np.ones(len(rows))]) @ fit
        np.testing.assert_allclose(seen, one.page_map[rows, cols], atol=INCH_MM / DPI)  # the picture is whole pixels
