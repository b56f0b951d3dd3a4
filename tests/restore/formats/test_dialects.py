"""One page as many programs spell it: its picture and its surface are found, and what was guessed is said."""

import base64
import io
import json
import struct
import unicodedata

import numpy as np
import pytest
from PIL import Image

from restore import BadInput
from restore.formats import load_scan, referenced_files

CORNERS = np.array([[0, 0, 0], [60, 0, 3], [60, 40, 0], [0, 40, 1]], float)
UV = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
VERTICES = "".join("v {} {} {}\n".format(*corner) for corner in CORNERS)
COORDINATES = "".join("vt {} {}\n".format(*uv) for uv in UV)
FACES = "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
GREY, RED = (130, 130, 130), (200, 10, 10)


def picture(colour=GREY, kind="PNG"):
    data = io.BytesIO()
    Image.new("RGB", (60, 40), colour).save(data, kind)
    return data.getvalue()


@pytest.fixture
def obj(tmp_path):
    """Write an OBJ file with the heads given, and files beside it; returns what is read."""

    def write(head, text=VERTICES + COORDINATES, faces=FACES, **files):
        for name, data in files.items():
            file = tmp_path / name.replace("__", ".")
            file.write_bytes(data if isinstance(data, bytes) else data.encode())
        (tmp_path / "page.obj").write_text(head + text + faces)
        return load_scan(tmp_path / "page.obj")

    return write


def said(mesh):
    return " ".join(one.text for one in mesh.findings)


def test_two_spellings_of_one_picture_are_one(obj):
    mesh = obj(
        "mtllib a.mtl\n",
        faces="usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 4/4\n",
        a__mtl="newmtl a\nmap_Kd ./P.png\nnewmtl b\nmap_Kd p.png\n",
        p__png=picture(),
    )
    assert mesh.texture.shape == (40, 60, 3)


def test_several_material_files_stand_on_one_line(obj):
    files = {"one__mtl": "newmtl x\nKd 1 0 0\n", "two__mtl": "newmtl page\nmap_Kd p.png\n", "p__png": picture()}
    mesh = obj("mtllib one.mtl two.mtl\nusemtl page\n", **files)
    assert mesh.texture is not None


def test_a_missing_material_file_is_reported_and_the_nearby_picture_taken(obj):
    relief = obj("mtllib gone.mtl\nusemtl page\n")
    assert relief.texture is None
    assert "'gone.mtl' is missing" in said(relief)
    assert "--texture" in said(relief)
    assert obj("mtllib gone.mtl\nusemtl page\n", page__png=picture()).texture is not None


def test_a_material_that_its_file_lacks_is_said(obj):
    mesh = obj("mtllib a.mtl\nusemtl Material.001\n", a__mtl="newmtl material_001\nmap_Kd p.png\n", p__png=picture())
    assert mesh.texture is not None
    assert "does not define" in said(mesh)


@pytest.mark.parametrize("key", ["map_Kd", "map_Ka", "map_Ke"])
@pytest.mark.parametrize(
    ("written", "named"),
    [
        ("scan.jpg", "Scan.JPG"),
        ("page.png", "C:\\Users\\me\\page.png"),
        ("page.png", "../textures/page.png"),
        (unicodedata.normalize("NFD", "bücher.png"), unicodedata.normalize("NFC", "bücher.png")),
    ],
)
def test_a_picture_is_found_by_a_name_of_another_system(obj, tmp_path, written, named, key):
    (tmp_path / written).write_bytes(picture())
    assert obj("mtllib a.mtl\nusemtl p\n", a__mtl=f"newmtl p\n{key} {named}\n").texture is not None
    assert {file.name for file in referenced_files(tmp_path / "page.obj")} == {"a.mtl", written}


def test_numbers_with_decimal_commas_are_read_with_a_warning(obj):
    text = (VERTICES.replace(".0", ",0") + COORDINATES.replace(".0", ",0")).replace("60,0", "60,5")
    mesh = obj("", text)
    assert mesh.vertices[:, 0].max() == 60.5
    assert "decimal commas" in said(mesh)


def test_several_pictures_are_packed_into_one(obj):
    mesh = obj(
        "mtllib a.mtl\n",
        faces="usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 4/4\n",
        a__mtl="newmtl a\nmap_Kd a.png\nnewmtl b\nmap_Kd b.png\n",
        a__png=picture(GREY),
        b__png=picture(RED),
    )
    assert "2 texture images" in said(mesh)
    for face in mesh.faces:
        x, y = np.rint(mesh.texcoords[face].mean(axis=0)).astype(int)
        left = CORNERS[[0, 2, 3]].mean(axis=0)[0] - 1e-6 < mesh.vertices[face].mean(axis=0)[0] < 30
        assert tuple(mesh.texture[y, x]) == (RED if left else GREY)


def ply(path, vertex="", face="", rows=(), corners=(), comments=""):
    head = f"ply\nformat ascii 1.0\n{comments}element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    head += f"{vertex}element {face}end_header\n"
    values = [" ".join(map(str, corner)) + extra for corner, extra in zip(CORNERS, rows or [""] * 4, strict=True)]
    path.write_text(head + "\n".join([*values, *corners]) + "\n")
    return load_scan(path)


def test_triangle_strips_are_triangles_that_run_one_way(tmp_path):
    mesh = ply(
        tmp_path / "a.ply",
        face="tristrips 1\nproperty list int int vertex_indices\n",
        corners=["7 0 1 3 2 -1 0 1"],
    )
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert len(mesh.faces) == 2
    assert (np.cross(b - a, c - a)[:, 2] > 0.0).all()


TEXNUMBER = (
    "face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty int texnumber\n"
)


def test_faces_of_several_pictures_have_numbers(tmp_path):
    for name, colour in (("a.png", GREY), ("b.png", RED)):
        (tmp_path / name).write_bytes(picture(colour))
    mesh = ply(
        tmp_path / "a.ply",
        face=TEXNUMBER,
        corners=["3 0 1 2 6 0 0 1 0 1 1 0", "3 0 2 3 6 0 0 1 1 0 1 1"],
        comments="comment TextureFile a.png\ncomment TextureFile b.png\n",
    )
    colours = [mesh.texture[tuple(np.rint(mesh.texcoords[face].mean(axis=0)).astype(int)[::-1])] for face in mesh.faces]
    assert [tuple(colour) for colour in colours] == [GREY, RED]


def test_a_file_names_its_picture_by_its_own_name(tmp_path):
    (tmp_path / "scan.png").write_bytes(picture())
    mesh = ply(
        tmp_path / "scan.ply",
        vertex="property float s\nproperty float t\n",
        face="face 2\nproperty list uchar int vertex_indices\n",
        rows=[" {} {}".format(*uv) for uv in UV],
        corners=["3 0 1 2", "3 0 2 3"],
        comments="comment TextureFile <this>.png\n",
    )
    assert mesh.texture is not None
    assert [file.name for file in referenced_files(tmp_path / "scan.ply")] == ["scan.png"]


def test_colours_of_faces_paint_the_page(tmp_path):
    mesh = ply(
        tmp_path / "a.ply",
        face="face 2\nproperty list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\n"
        "property uchar blue\n",
        corners=["3 0 1 2 200 10 10", "3 0 2 3 10 10 200"],
    )
    assert mesh.provenance["texture_source"] == "colours of vertices"


@pytest.mark.parametrize(("used", "holes"), [(False, False), (True, True)])
def test_vertices_that_are_not_numbers_are_left_out(obj, used, holes):
    faces = FACES + ("f 5/1 2/2 3/3\n" if used else "")
    mesh = obj("", VERTICES + "v nan nan nan\n" + COORDINATES, faces)
    assert len(mesh.vertices) == 4
    assert ("not a number" in said(mesh)) == holes


def gltf(images, material, *, textures=({"source": 0},), used=(), extra=()):
    """The header of a page in metres with one picture, and its buffer."""
    arrays = [
        (CORNERS / 1000).astype("<f4"),
        (UV * [1, -1] + [0, 1]).astype("<f4"),
        np.array([0, 1, 2, 0, 2, 3], "<u4"),
    ]
    data, views, accessors = b"", [], []
    for array, component, kind in zip(arrays, (5126, 5126, 5125), ("VEC3", "VEC2", "SCALAR"), strict=True):
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(array), "type": kind})
        data += array.tobytes()
    for part in extra:
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(part)})
        data += part
    primitive = {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}
    return {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}], "accessors": accessors, "bufferViews": views,
        "materials": [material], "images": list(images), "textures": list(textures),
        "buffers": [{"byteLength": len(data)}], "extensionsUsed": list(used), "extensionsRequired": list(used),
    }, data  # fmt: skip


def glb(path, header, data):
    text = json.dumps(header).encode()
    text, data = text + b" " * (-len(text) % 4), data + b"\0" * (-len(data) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
    return load_scan(path)


BASE = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
SPECULAR = "KHR_materials_pbrSpecularGlossiness"


@pytest.mark.parametrize(
    ("material", "used"),
    [
        (BASE, ()),
        ({"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}}, ()),
        ({"extensions": {SPECULAR: {"diffuseTexture": {"index": 0}}}}, (SPECULAR,)),
    ],
)
@pytest.mark.parametrize("place", ["data", "beside"])
def test_a_picture_is_in_the_header_or_in_a_file_of_its_own(tmp_path, material, used, place):
    (tmp_path / "tex dir").mkdir()
    (tmp_path / "tex dir" / "p.png").write_bytes(picture())
    data = "data:image/png;base64," + base64.b64encode(picture()).decode()
    uri = data if place == "data" else "tex%20dir/p.png"
    mesh = glb(tmp_path / "a.glb", *gltf([{"uri": uri}], material, used=used))
    assert mesh.texture.shape == (40, 60, 3)
    assert mesh.texcoords is not None


def test_pictures_may_be_webp(tmp_path):
    name = "EXT_texture_webp"
    textures = [{"extensions": {name: {"source": 0}}}]
    images = [{"bufferView": 3, "mimeType": "image/webp"}]
    header, data = gltf(images, BASE, textures=textures, used=(name,), extra=[picture(kind="WEBP")])
    assert glb(tmp_path / "a.glb", header, data).texture.shape == (40, 60, 3)


def test_gltf_in_separate_files_is_read_like_a_binary_one(tmp_path):
    header, data = gltf([{"uri": "p.png"}], BASE)
    (tmp_path / "p.png").write_bytes(picture())
    (tmp_path / "page.bin").write_bytes(data)
    whole = glb(tmp_path / "a.glb", header, data)
    header["buffers"][0]["uri"] = "page.bin"
    (tmp_path / "a.gltf").write_text(json.dumps(header))
    apart = load_scan(tmp_path / "a.gltf")
    np.testing.assert_array_equal(apart.vertices, whole.vertices)
    np.testing.assert_array_equal(apart.texcoords, whole.texcoords)
    (tmp_path / "page.bin").unlink()
    with pytest.raises(BadInput, match=r"its buffer 'page\.bin' is missing"):
        load_scan(tmp_path / "a.gltf")


def test_gltf_with_a_picture_for_each_part_is_packed(tmp_path):
    header, data = gltf([{"bufferView": 3}, {"bufferView": 4}], BASE, extra=[picture(GREY), picture(RED)])
    header["textures"].append({"source": 1})
    header["materials"].append({"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}})
    (primitive,) = header["meshes"][0]["primitives"]
    header["accessors"] += [
        {"bufferView": 2, "byteOffset": at, "componentType": 5125, "count": 3, "type": "SCALAR"} for at in (0, 12)
    ]
    parts = [{**primitive, "indices": 3 + k, "material": k} for k in (0, 1)]
    header["meshes"][0]["primitives"] = parts
    mesh = glb(tmp_path / "a.glb", header, data)
    assert "2 texture images" in said(mesh)
    colours = [mesh.texture[tuple(np.rint(mesh.texcoords[face].mean(axis=0)).astype(int)[::-1])] for face in mesh.faces]
    assert {tuple(colour) for colour in colours} == {GREY, RED}
