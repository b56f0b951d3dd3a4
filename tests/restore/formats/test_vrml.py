"""VRML 1.0 as the scanner's own software writes it."""

import re

import numpy as np
import pytest
from PIL import Image

from restore.errors import BadInput
from restore.formats import load_scan, write_vrml
from restore.formats.vrml import read_vrml
from restore.scan import RangeScan, SurfaceMesh

HALF_DIGIT_MM = 0.00501  # the text has two decimals
PLACE_PX = 0.05  # where two decimals at 700 mm leave a sample in the picture: 0.007 mm of 0.36 mm a pixel, twice over

SQUARE = "#VRML V1.0 ascii\nSeparator { Coordinate3 { point [ 0 0 -700, 9 0 -700, 9 9 -700, 0 9 -700 ] } %s }"


def test_a_scan_comes_back_on_its_grid(shot, tmp_path):
    scan = shot(24, 32)
    write_vrml(scan, tmp_path / "page.wrl")
    back = load_scan(tmp_path / "page.wrl")
    assert isinstance(back, RangeScan)
    assert back.provenance["lens"] == "MIDDLE"
    seen = back.measured
    assert seen.sum() > 0.95 * scan.measured.sum()  # a sample without any neighbour belongs to no face
    np.testing.assert_allclose(back.points[seen], scan.points[seen], atol=HALF_DIGIT_MM, rtol=0)
    np.testing.assert_allclose(back.texture_xy, scan.texture_xy, atol=PLACE_PX, rtol=0)
    np.testing.assert_array_equal(back.texture, scan.texture)


def test_the_text_is_what_the_scanners_software_writes(shot, tmp_path):
    write_vrml(shot(3, 3, missing=0), tmp_path / "page.wrl")
    text = (tmp_path / "page.wrl").read_text()
    assert text.startswith("#VRML V1.0 ascii\n# VIVID-S\n")
    assert "# Object name : page\n" in text
    point = re.search(r"point \[ *\n(.*?)\]", text, re.DOTALL)[1]
    assert all(re.fullmatch(r"-?\d+\.\d\d -?\d+\.\d\d -\d+\.\d\d,", line) for line in point.strip().split("\n"))
    assert "0, 3, 4, 1, -1," in text  # a quadrilateral, counter-clockwise seen by the scanner


def test_display_transforms_and_comments_are_left_out(tmp_path):
    faces = "Transform { scaleFactor 2 2 2 } # ] }\nIndexedFaceSet { coordIndex [ 0, 1, 2, 3, -1, 0, 1, 2 ] }"
    (tmp_path / "a.wrl").write_text(SQUARE % faces)
    mesh = read_vrml(tmp_path / "a.wrl")
    assert isinstance(mesh, SurfaceMesh)
    assert mesh.vertices[2].tolist() == [9, 9, -700]
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 2]]


def test_texture_coordinates_and_the_picture_they_name(tmp_path):
    node = (
        'Texture2 { filename "a#1.png" } TextureCoordinate2 { point [ 0 0, 1 0, 1 1, 0 1, 0.5 0.5 ] }'
        "IndexedFaceSet { coordIndex [ 0,1,2,-1, 0,2,3,-1 ] textureCoordIndex [ 0,1,2,-1, 4,2,3,-1 ] }"
    )
    (tmp_path / "a.wrl").write_text(SQUARE % node)
    Image.new("RGB", (20, 10), (1, 2, 3)).save(tmp_path / "a#1.png")
    mesh = read_vrml(tmp_path / "a.wrl")
    corners = {tuple(v) + tuple(t) for v, t in zip(mesh.vertices[:, :2], mesh.texcoords, strict=True)}
    # Vertex 0 is on a seam: it has two places in the picture.
    assert corners == {(0, 0, -0.5, 9.5), (0, 0, 9.5, 4.5), (9, 0, 19.5, 9.5), (9, 9, 19.5, -0.5), (0, 9, -0.5, -0.5)}
    assert mesh.texture.shape == (10, 20, 3)


def test_pieces_are_put_together(tmp_path):
    piece = "IndexedFaceSet { coordIndex [ 0, 1, 2, -1 ] }"
    second = "Coordinate3 { point [ 5 5 -1, 6 5 -1, 6 6 -1 ] }"
    (tmp_path / "a.wrl").write_text(SQUARE % f"{piece} {second} {piece}")
    mesh = load_scan(tmp_path / "a.wrl")
    assert mesh.vertices[mesh.faces[1], 0].tolist() == [5, 6, 6]


@pytest.mark.parametrize(
    ("node", "fault"),
    [
        ("", "no complete IndexedFaceSet"),
        ("IndexedFaceSet { coordIndex [ 0, 1", "seems cut short: a bracket does not end"),
        ("IndexedFaceSet { coordIndex ] 0, 1 [ }", "the list coordIndex is missing or does not end"),
        ("IndexedFaceSet { }", "the list coordIndex is missing"),
        ("IndexedFaceSet { coordIndex [ 0, 1, 4, -1 ] }", "uses number 4 of 4"),
        ("IndexedFaceSet { coordIndex [ 0, 1, 2.5, -1 ] }", "cannot be an index"),
        ("IndexedFaceSet { coordIndex [ 0, 1, two, -1 ] }", "holds b'two', which is not a number"),
        ("IndexedFaceSet { coordIndex [ 0, 1, -1 ] }", "has no triangle"),
        ("Coordinate3 { point [ 1 2 ] } IndexedFaceSet { coordIndex [ 0 ] }", "not a multiple of 3"),
        ("Coordinate3 { point [ nan 2 3 ] } IndexedFaceSet { coordIndex [ 0 0 0 ] }", "lies at .nan"),
        ("TextureCoordinate2 { point [ 0 0 ] } IndexedFaceSet { coordIndex [ 0 1 2 ] }", "do not match the faces"),
    ],
)
def test_damage_is_named(tmp_path, node, fault):
    (tmp_path / "bad.wrl").write_text(SQUARE % node)
    with pytest.raises(BadInput, match=f"bad.wrl.*{fault}"):
        load_scan(tmp_path / "bad.wrl")


def test_another_version_is_refused(tmp_path):
    (tmp_path / "new.wrl").write_text("#VRML V2.0 utf8\nShape { }")
    with pytest.raises(BadInput, match=r"new\.wrl is not VRML 1\.0"):
        load_scan(tmp_path / "new.wrl")


def test_many_face_sets_use_their_vertices_without_repeating_them(tmp_path):
    piece = "IndexedFaceSet { coordIndex [ 0, 1, 2, -1 ] }\n"
    (tmp_path / "a.wrl").write_text(SQUARE % (piece * 900))
    mesh = load_scan(tmp_path / "a.wrl")
    assert (len(mesh.vertices), len(mesh.faces)) == (3, 1)  # copies of a face are merged
    assert any("899" in one.text for one in mesh.findings)
    (tmp_path / "a.wrl").write_text(SQUARE % (piece * 1001))
    with pytest.raises(BadInput, match=r"a\.wrl has more than 1000 face sets"):
        load_scan(tmp_path / "a.wrl")
