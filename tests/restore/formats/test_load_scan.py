"""The one door to scan files."""

import os
import socket

import numpy as np
import pytest
import trimesh
from PIL import Image

from restore.errors import BadInput
from restore.formats import READERS, load_scan, save_scan, scan_stem, write_abs, write_obj, write_ply, write_vrml
from restore.formats.parsing import source
from restore.scan import RangeScan, SurfaceMesh

HALF_DIGIT_MM = 0.00501  # VRML has two decimals, all others more
PLACE_PX = 0.05  # where two decimals leave a sample in the picture, twice over


def test_an_unknown_kind_is_refused_with_the_known_ones(tmp_path):
    (tmp_path / "scan.cdm").write_bytes(b"x")
    with pytest.raises(BadInput, match=r"scan\.cdm") as caught:
        load_scan(tmp_path / "scan.cdm")
    assert all(extension in caught.value.hint for extension in READERS)


def test_what_is_not_a_regular_file_is_reported(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(BadInput, match="pipe is not a regular file"):
        load_scan(tmp_path / "pipe")


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(BadInput, match="session_1 does not exist"):
        load_scan(tmp_path / "session_1")


@pytest.mark.parametrize("extension", READERS)
def test_a_missing_and_an_empty_file_are_named(tmp_path, extension):
    path = tmp_path / f"scan{extension}"
    with pytest.raises(BadInput, match=f"scan{extension} does not exist"):
        load_scan(path)
    path.touch()
    with pytest.raises(BadInput, match=f"scan{extension} is empty"):
        load_scan(path)


def test_capital_letters_are_as_good(shot, tmp_path):
    write_abs(shot(), tmp_path / "SCAN.ABS.GZ")
    assert load_scan(str(tmp_path / "SCAN.ABS.GZ")).measured.any()


def test_a_pipe_is_not_a_scan_and_does_not_block(tmp_path):
    os.mkfifo(tmp_path / "scan.abs")
    with pytest.raises(BadInput, match="not a regular file"):
        load_scan(tmp_path / "scan.abs")


def test_a_name_that_no_disk_takes_is_named():
    for name in ("a\0b.abs", "x" * 5000 + ".abs"):
        with pytest.raises(BadInput, match=r"\.abs cannot be read"):
            load_scan(name)


def test_a_file_beyond_the_limit_is_refused_unread(shot, tmp_path, monkeypatch):
    write_abs(shot(), tmp_path / "scan.abs")
    monkeypatch.setattr(source.read_bytes, "__defaults__", (100,))
    with pytest.raises(BadInput, match=r"scan\.abs is larger than 100 bytes"):
        load_scan(tmp_path / "scan.abs")


@pytest.mark.parametrize(
    ("name", "stem"), [("book.abs.gz", "book"), ("a.b.obj", "a.b"), ("BOOK.ABS.GZ", "BOOK"), ("session_1", "session_1")]
)
def test_the_stem_of_a_scan(tmp_path, name, stem):
    assert scan_stem(tmp_path / name) == stem


def test_the_stem_of_a_folder_is_its_whole_name(tmp_path):
    (tmp_path / "2024.05").mkdir()
    assert scan_stem(tmp_path / "2024.05") == "2024.05"


def test_a_name_as_long_as_the_disk_takes_is_fine(tmp_path):
    name = "x" * 251 + ".obj"  # with .tiff, the name of a picture beside it would be too long
    (tmp_path / name).write_text("v 0 0 -1\nv 1 0 -1\nv 0 1 -1\nf 1 2 3\n")
    assert len(load_scan(tmp_path / name).faces) == 1


def test_one_shot_is_the_same_in_every_format(shot, mesh, tmp_path):
    scan, sheet = shot(48, 64, missing=0.02), mesh(rows=48, cols=64, missing=0.02)
    writers = {
        "a.obj": lambda path: write_obj(sheet, path),
        "a.ply": lambda path: write_ply(sheet, path),
        "a.wrl": lambda path: write_vrml(scan, path),
        "a.stl": lambda path: trimesh.Trimesh(sheet.vertices, sheet.faces, process=False).export(path),
        "folder": lambda path: save_scan(scan, path),
    }
    for name, write in writers.items():
        write(tmp_path / name)
        back = load_scan(tmp_path / name)
        seen = back.measured
        assert seen.sum() > 0.99 * scan.measured.sum()
        np.testing.assert_allclose(back.points[seen], scan.points[seen], atol=HALF_DIGIT_MM, rtol=0)
        np.testing.assert_allclose(back.texture_xy, scan.texture_xy, atol=PLACE_PX, rtol=0)
        np.testing.assert_array_equal(back.texture, scan.texture)


def test_a_given_picture_goes_before_the_files_own(mesh, tmp_path):
    write_obj(mesh(), tmp_path / "a.obj")
    Image.new("RGB", (1280, 960), (7, 7, 7)).save(tmp_path / "other.png")
    scan = load_scan(tmp_path / "a.obj", tmp_path / "other.png")
    assert (scan.texture == 7).all()
    own = load_scan(tmp_path / "a.obj")
    # The same places, in pixels of half the size.
    np.testing.assert_allclose(scan.texture_xy, 2 * own.texture_xy + 0.5, atol=1e-3)


def test_a_given_picture_needs_a_place(mesh, tmp_path):
    sheet = mesh()
    write_ply(SurfaceMesh(sheet.vertices + [60.0, 0, 300], sheet.faces), tmp_path / "moved.ply")
    Image.new("RGB", (640, 480)).save(tmp_path / "other.png")
    with pytest.raises(BadInput, match=r"moved\.ply does not say where the image .*other\.png lies on it"):
        load_scan(tmp_path / "moved.ply", tmp_path / "other.png")
    Image.new("RGB", (640, 480)).save(tmp_path / "moved.png")
    assert load_scan(tmp_path / "moved.ply").texture is None  # a picture that only happens to be there is let be


def test_a_given_picture_that_is_missing_is_named(mesh, tmp_path):
    write_ply(mesh(), tmp_path / "a.ply")
    with pytest.raises(BadInput, match=r"gone\.png does not exist"):
        load_scan(tmp_path / "a.ply", tmp_path / "gone.png")


def test_a_scan_folder_keeps_its_own_picture(shot, tmp_path):
    save_scan(shot(), tmp_path / "scan")
    Image.new("RGB", (640, 480)).save(tmp_path / "other.png")
    with pytest.raises(BadInput, match="a scan folder has its own image"):
        load_scan(tmp_path / "scan", tmp_path / "other.png")


def test_a_mesh_of_any_other_thing_stays_a_mesh(tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=3, radius=40)
    ball.apply_translation([0, 0, -700])
    ball.export(tmp_path / "ball.ply")
    mesh = load_scan(tmp_path / "ball.ply")
    assert type(mesh) is SurfaceMesh
    assert len(mesh.faces) == len(ball.faces)
    assert mesh.texcoords is None


def test_nothing_is_fetched_from_the_net(mesh, tmp_path, monkeypatch):
    monkeypatch.setattr(socket, "socket", None)
    write_obj(mesh(), tmp_path / "a.obj")
    (tmp_path / "a.mtl").write_text("newmtl page\nmap_Kd http://localhost/b.png\n")
    with pytest.raises(BadInput, match="outside its own folder"):
        load_scan(tmp_path / "a.obj")


def test_the_scan_is_a_range_scan_with_its_lens(mesh, tmp_path):
    write_ply(mesh(), tmp_path / "a.ply")
    scan = load_scan(tmp_path / "a.ply")
    assert isinstance(scan, RangeScan)
    assert scan.provenance == {"file": "a.ply", "lens": "MIDDLE"}
