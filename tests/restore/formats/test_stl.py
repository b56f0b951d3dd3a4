"""Triangles without colour."""

import numpy as np
import pytest
import trimesh
from PIL import Image

from restore.errors import BadInput
from restore.formats import load_scan
from restore.formats.stl import read_stl

HALF_FLOAT_MM = 3.1e-5  # half the last place of a float32 between 512 and 1024
PLACE_PX = 0.01  # what that moves a sample in the picture, with room for the fitted lattice


@pytest.fixture
def exported(mesh, tmp_path):
    def export(kind="stl", **options):
        sheet = mesh(**options)
        path = tmp_path / "page.stl"
        trimesh.Trimesh(sheet.vertices, sheet.faces, process=False).export(path, file_type=kind)
        return path

    return export


@pytest.mark.parametrize("kind", ["stl", "stl_ascii"])
def test_triangles_come_back_on_their_grid_with_the_picture_beside(exported, shot, tmp_path, kind):
    path, scan = exported(kind, rows=24, cols=32), shot(24, 32)
    Image.fromarray(scan.texture).save(tmp_path / "page.png")
    back = load_scan(path)
    seen = back.measured
    np.testing.assert_allclose(back.points[seen], scan.points[seen], atol=HALF_FLOAT_MM, rtol=0)
    np.testing.assert_allclose(back.texture_xy, scan.texture_xy, atol=PLACE_PX, rtol=0)
    np.testing.assert_array_equal(back.texture, scan.texture)


def test_corners_at_one_place_become_one_vertex(exported, mesh):
    sheet, back = mesh(), read_stl(exported())
    assert len(back.vertices) == len(np.unique(sheet.faces))
    np.testing.assert_allclose(back.vertices[back.faces], sheet.vertices[sheet.faces], atol=HALF_FLOAT_MM)


@pytest.mark.parametrize("share", [0.02, 0.3, 0.6, 0.99])
@pytest.mark.parametrize("kind", ["stl", "stl_ascii"])
def test_a_cut_file_is_told(exported, kind, share):
    path = exported(kind)
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(BadInput, match=r"page\.stl seems cut short"):
        load_scan(path)


def test_a_second_solid_that_is_cut_is_told(exported):
    path = exported("stl_ascii")
    text = path.read_bytes()
    path.write_bytes(text + text[: len(text) // 2])
    with pytest.raises(BadInput, match=r"page\.stl seems cut short"):
        load_scan(path)


@pytest.mark.parametrize(
    ("damage", "fault"),
    [
        (lambda data: data + b"more", "triangles need"),
        (lambda data: b"hello", "has 5 bytes, its 0 triangles need 84|seems cut short"),
        (lambda data: b"\0" * 84, "no triangle"),
    ],
)
def test_a_file_of_another_length_is_named(exported, damage, fault):
    path = exported()
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(BadInput, match=rf"page\.stl.*({fault})"):
        load_scan(path)


def test_nothing_is_said_of_it_but_the_error(exported, caplog, capfd):
    path = exported("stl_ascii")
    path.write_text(path.read_text().replace("normal -", "normal minus", 1).replace("vertex -", "vertex minus", 1))
    with pytest.raises(BadInput):
        load_scan(path)
    assert not caplog.records
    assert capfd.readouterr() == ("", "")


def test_text_that_is_no_number_is_named(exported):
    path = exported("stl_ascii")
    path.write_text(path.read_text().replace("vertex -", "vertex minus", 1))
    with pytest.raises(BadInput, match=r"page\.stl: a vertex holds b'minus"):
        load_scan(path)
