"""Which files belong to a scan: what each format names, and the picture of its name."""

from __future__ import annotations

from pathlib import Path

import pytest

from station.intake.companions import Companions, Pairing, is_scan
from station.intake.listing import list_files

PLY = b"ply\ncomment TextureFile %s\nend_header\n"


def found(folder: Path, source: str, files: dict[str, bytes]) -> Companions:
    for name, data in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)
    pairing = Pairing(folder)
    pairing.update(list_files(folder, without=folder / "out"))
    return pairing.companions(Path(source))


@pytest.mark.parametrize("name", ["a.obj", "A.WRL", "a.abs.gz", "a.b.ply"])
def test_names_of_scans(name: str) -> None:
    assert is_scan(Path(name))
    assert not is_scan(Path(name + ".part"))


@pytest.mark.parametrize(
    ("source", "data", "named"),
    [
        ("p.obj", b"mtllib  p.mtl \r\n", {"p.mtl": "p.mtl", "skin.png": "skin.png"}),
        ("p.obj", b"# mtllib no.mtl\nmtllib tex\\p.mtl\n", {"tex/p.mtl": "tex/p.mtl", "x.jpg": "tex/X.JPG"}),
        ("p.wrl", b'Texture2 { filename "skin.png" }', {"skin.png": "skin.png"}),
        ("p.ply", PLY % b"skin.png", {"skin.png": "skin.png"}),
        ("p.ply", PLY % b"SKIN.PNG", {"SKIN.PNG": "skin.png"}),
    ],
)
def test_the_files_that_a_format_names(tmp_path: Path, source: str, data: bytes, named: dict[str, str]) -> None:
    files = {source: data, "p.mtl": b"map_Kd -clamp on -s 1 1 1 skin.png\n", "tex/p.mtl": b"map_Kd x.jpg\n"}
    files |= {"skin.png": b"", "tex/X.JPG": b"", "other.png": b""}
    companions = found(tmp_path, source, files)
    assert {name: str(path) for name, path in companions.found.items()} == named
    assert not companions.missing


@pytest.mark.parametrize("reference", [b"gone.mtl", b"../p.mtl", b"/etc/passwd", b""])
def test_a_file_that_is_not_there_or_outside_is_missing(tmp_path: Path, reference: bytes) -> None:
    companions = found(tmp_path, "sub/p.obj", {"sub/p.obj": b"mtllib " + reference + b"\n", "p.mtl": b""})
    assert companions == Companions({}, missing=True)


@pytest.mark.parametrize(("first", "second"), [("p.mtl", "p.mtl"), ("q.mtl", "p.mtl"), ("./p.mtl", "P.MTL")])
def test_material_files_that_name_each_other_are_read_once(tmp_path: Path, first: str, second: str) -> None:
    material = "map_Kd {}\nmap_Kd skin.png\n"
    files = {"p.obj": b"mtllib p.mtl\n", "p.mtl": material.format(first).encode(), "skin.png": b""}
    files["q.mtl"] = material.format(second).encode()
    companions = found(tmp_path, "p.obj", files)
    assert {"p.mtl", "skin.png"} <= set(companions.found) <= {"p.mtl", "P.MTL", "q.mtl", "skin.png"}
    assert not companions.missing


def test_the_picture_of_the_same_name_in_the_order_of_preference(tmp_path: Path) -> None:
    files = {"Page.VVD": b"", "page.jpg": b"", "PAGE.Tif": b"", "sub/page.png": b""}
    assert found(tmp_path, "Page.VVD", files) == Companions({"Page.tif": Path("PAGE.Tif")}, missing=False)


def test_scans_with_their_colours_inside_need_no_picture(tmp_path: Path) -> None:
    files = {"a.glb": b"", "b.ply": b"ply\nproperty uchar red\n", "c.ply": b"ply\n", "d.stl": b""}
    missing = {name: found(tmp_path, name, files).missing for name in files}
    assert missing == {"a.glb": False, "b.ply": False, "c.ply": True, "d.stl": True}


def test_a_file_is_read_again_only_when_it_changes(tmp_path: Path) -> None:
    (tmp_path / "p.wrl").write_bytes(b'filename "a.png"')
    pairing = Pairing(tmp_path)
    listing = list_files(tmp_path, without=tmp_path / "out")
    pairing.update(listing)
    assert pairing.companions(Path("p.wrl")).missing
    (tmp_path / "p.wrl").unlink()
    assert pairing.companions(Path("p.wrl")).missing  # not read
    (tmp_path / "p.wrl").write_bytes(b'filename "longer.png"')
    (tmp_path / "longer.png").touch()
    pairing.update(list_files(tmp_path, without=tmp_path / "out"))
    assert not pairing.companions(Path("p.wrl")).missing


def test_corrections_belong_to_a_scan_and_stand_for_no_picture(tmp_path: Path) -> None:
    files = {"p.ply": b"ply\nend_header\n", "p.edits.json": b"{}", "q.edits.json": b"{}"}
    companions = found(tmp_path, "p.ply", files)
    assert companions.found == {"p.edits.json": Path("p.edits.json")}
    assert companions.missing  # its picture may still come
