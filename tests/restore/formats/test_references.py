"""The files that a scan refers to are known, whatever is wrong with them."""

import pytest

from restore.formats import referenced_files


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "tex").mkdir()
    for name in ("tex/page.png", "page.mtl", "other picture.png"):
        (tmp_path / name).write_bytes(b"-")
    return tmp_path


def referred(folder, name, text):
    (folder / name).write_bytes(text)
    return [file.relative_to(folder.resolve()).as_posix() for file in referenced_files(folder / name)]


@pytest.mark.parametrize(
    "name, text",
    [
        ("a.ply", b"ply\ncomment TextureFile tex/page.png\n"),
        ("a.ply", b"ply\r\ncomment texturefile tex\\page.png\r\n"),
        ("a.wrl", b'#VRML V1.0 ascii\nTexture2 { filename "tex/page.png" }'),
    ],
)
def test_a_file_names_its_picture(folder, name, text):
    assert referred(folder, name, text) == ["tex/page.png"]


@pytest.mark.parametrize("options", [b"", b"-s 1 1 1 ", b"-clamp on -bm 0.5 "])
def test_an_obj_names_its_material_file_and_that_its_picture(folder, options):
    (folder / "page.mtl").write_bytes(b"newmtl page\n\tmap_Kd " + options + b"tex/page.png\r\n")
    assert referred(folder, "a.obj", b"mtllib page.mtl\nv 0 0 0\n") == ["page.mtl", "tex/page.png"]


@pytest.mark.parametrize("picture", ["tex/page.png", "page.png"])
def test_a_picture_lies_next_to_the_mesh_or_next_to_the_material_file(folder, picture):
    (folder / picture).write_bytes(b"-")
    (folder / "tex" / "page.mtl").write_bytes(b"map_Kd page.png")
    assert picture in referred(folder, "a.obj", b"mtllib tex/page.mtl\n")


def test_files_that_name_each_other_are_reported_once(folder):
    (folder / "page.mtl").write_bytes(b"map_Kd other picture.png\nmap_Kd a.obj\nmap_Kd page.mtl\n")
    assert referred(folder, "a.obj", b"mtllib page.mtl\nmtllib page.mtl\n") == ["page.mtl", "other picture.png"]


def test_what_is_missing_or_outside_the_folder_is_left_to_the_reader(folder):
    (folder.parent / "outside.png").write_bytes(b"-")
    assert referred(folder, "a.ply", b"comment TextureFile ../outside.png\ncomment TextureFile none.png\n") == []
    assert referenced_files(folder / "none.obj") == referenced_files(folder / "tex") == []
