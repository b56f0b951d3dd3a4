"""Arrays that do not fit together are refused with the reason, before any work."""

from dataclasses import replace

import numpy as np
import pytest

from restore import restore
from restore.errors import BadInput
from restore.scan import RangeScan, SurfaceMesh
from restore.scan_check import refuse_unusable_image, refuse_unusable_mesh

ROWS, COLS = 30, 40
PICTURE = np.zeros((60, 80, 3), np.uint8)


@pytest.fixture
def scan():
    y, x = np.indices((ROWS, COLS)).astype(float)
    return RangeScan(np.dstack([x, -y, np.full_like(x, -900.0)]), PICTURE, 2.0 * np.dstack([x, y]))


@pytest.fixture
def mesh():
    vertices = np.array([[0, 0, -900], [90, 0, -900], [90, 60, -900.0]])
    return SurfaceMesh(vertices, np.array([[0, 1, 2]]), vertices[:, :2], PICTURE)


NO_PICTURES = [PICTURE[..., 0], PICTURE.astype(float), PICTURE[:0], np.dstack([PICTURE, PICTURE[..., :1]])]


def test_what_fits_together_passes(scan, mesh):
    for image in (scan, replace(scan, texture=None)):
        refuse_unusable_image(image)
    for sound in (mesh, replace(mesh, texture=None, texcoords=None)):
        refuse_unusable_mesh(sound)


@pytest.mark.parametrize("texture", NO_PICTURES, ids=["grey", "float", "empty", "four channels"])
def test_a_picture_is_of_bytes_in_three_colours(scan, mesh, texture):
    for shot in (scan, mesh):
        with pytest.raises(BadInput, match="is not an image"):
            restore(replace(shot, texture=texture))


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda scan: {"points": scan.points[0]}, "not a range grid"),
        (lambda scan: {"points": scan.points.astype(int)}, "not a range grid"),
        (lambda scan: {"texture_xy": scan.texture_xy[1:]}, "does not fit"),
        (lambda scan: {"texture_xy": scan.texture_xy + 1e6}, "lies in its colour image"),
        (lambda scan: {"texture_xy": scan.texture_xy * np.nan}, "lies in its colour image"),
    ],
)
def test_a_range_grid_fits_its_picture(scan, change, message):
    with pytest.raises(BadInput, match=message):
        restore(replace(scan, **change(scan)))


@pytest.mark.parametrize("far", [np.nan, np.inf, 1e30])
def test_texture_coordinates_are_finite_and_near_a_picture(mesh, far):
    texcoords = mesh.texcoords.copy()
    texcoords[0, 1] = far
    with pytest.raises(BadInput, match="not finite, or beyond every image"):
        restore(replace(mesh, texcoords=texcoords))


@pytest.mark.parametrize("shift", [[5000.0, 0.0], [0.0, -70.0]])
def test_a_mesh_lies_in_its_picture(mesh, shift):
    with pytest.raises(BadInput, match="no vertex of the mesh lies in its colour image"):
        restore(replace(mesh, texcoords=mesh.texcoords + shift))
