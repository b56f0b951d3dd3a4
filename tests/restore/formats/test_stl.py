"""Triangles without colour."""

import numpy as np
import pytest
import trimesh
from PIL import Image

from restore.errors import BadInput
from restore.formats import load_scan
from restore.formats.stl import TRIANGLE, read_stl

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
def test_triangles_come_back_on_their_grid_with_their_picture(exported, shot, tmp_path, kind):
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
def test_a_cut_file_is_reported(exported, kind, share):
    path = exported(kind)
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(BadInput, match=r"page\.stl seems cut short"):
        load_scan(path)


def test_a_second_solid_that_is_cut_is_reported(exported):
    path = exported("stl_ascii")
    text = path.read_bytes()
    path.write_bytes(text + text[: len(text) // 2])
    with pytest.raises(BadInput, match=r"page\.stl seems cut short"):
        load_scan(path)


@pytest.mark.parametrize(
    ("damage", "fault"),
    [
        (lambda data: data[:80] + b"\0\0\0\0" + data[84:] + b"more", "0 triangles need 84"),
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


def test_text_that_is_not_a_number_is_named(exported):
    path = exported("stl_ascii")
    path.write_text(path.read_text().replace("vertex -", "vertex minus", 1))
    with pytest.raises(BadInput, match=r"page\.stl: a vertex holds b'minus"):
        load_scan(path)


def binary(data, *, head=b"", count=None, behind=b""):
    """A binary file with another header, another number of triangles in it, or something behind them."""
    number = data[80:84] if count is None else count.to_bytes(4, "little")
    return head.ljust(80, b" ") + number + data[84:] + behind


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"head": b"solid exported by a program"}, None),
        ({"head": b"solid a\nsolid b"}, None),
        ({"head": b"solid", "behind": b"\0\0"}, "2 bytes after the 260 triangles"),
        ({"behind": b" " * 80}, "80 bytes after"),
        ({"count": 0}, "counts 0 triangles, the file holds 260"),
        ({"count": 2**32 - 1}, "counts 4294967295 triangles, the file holds 260"),
        ({"count": 200}, "counts 200 triangles, the file holds 260"),
    ],
)
def test_headers_of_other_programs_lose_no_triangle(exported, mesh, options, words):
    path = exported()
    path.write_bytes(binary(path.read_bytes(), **options))
    back = read_stl(path)
    assert len(back.faces) == len(mesh().faces)
    assert len(back.findings) == (words is not None) and all(words in one.text for one in back.findings)


def test_normals_that_are_not_numbers_are_not_read(exported, mesh):
    path = exported()
    triangles = np.frombuffer(path.read_bytes(), TRIANGLE, offset=84).copy()
    triangles["normal"] = np.nan
    path.write_bytes(path.read_bytes()[:84] + triangles.tobytes())
    assert len(read_stl(path).faces) == len(mesh().faces)


@pytest.mark.parametrize(
    "change",
    [
        str.upper,
        lambda text: text.replace("\n", "\r"),
        lambda text: "\ufeff" + text,
        lambda text: text.replace("endsolid", "end solid"),
        lambda text: text.replace("solid", "solid a vertex 1 2 model"),
        lambda text: text.replace("solid", "solid Blättchen"),
        lambda text: text.replace("endloop", "endloop of it") + "\x1a",
    ],
)
def test_text_of_other_programs_is_read(exported, mesh, change):
    path = exported("stl_ascii")
    path.write_text(change(path.read_text()), encoding="utf-8", newline="")
    back = read_stl(path)
    assert len(back.faces) == len(mesh().faces)
    assert back.findings == ()


def test_decimal_commas_are_read_with_a_warning(exported):
    path = exported("stl_ascii")
    whole = read_stl(path)
    path.write_text(path.read_text().replace(".", ","))
    commas = read_stl(path)
    np.testing.assert_array_equal(commas.vertices, whole.vertices)
    assert [one.code for one in commas.findings] == ["decimal_commas"]
