"""Binary glTF."""

import base64
import json
import struct

import numpy as np
import pytest
import trimesh
from PIL import Image

from restore.errors import BadInput
from restore.formats import load_scan
from restore.formats.parsing.mesh import texture_uv

HALF_FLOAT_MM = 3.1e-5  # half the last place of a float32 between 512 and 1024
FLOAT_PX = 1e-4  # a float32 of the picture's width


@pytest.fixture
def exported(mesh, tmp_path):
    """A textured .glb, and the way to change its header before it is written again."""

    def export(change=lambda header: None, **options):
        sheet = mesh(**options)
        picture = trimesh.visual.TextureVisuals(
            texture_uv(sheet.texcoords, sheet.texture), image=Image.fromarray(sheet.texture)
        )
        data = trimesh.Trimesh(sheet.vertices, sheet.faces, visual=picture, process=False).export(file_type="glb")
        size = struct.unpack_from("<I", data, 12)[0]
        header = json.loads(data[20 : 20 + size])
        change(header)
        text = json.dumps(header).encode()
        text += b" " * (-len(text) % 4)
        body = struct.pack("<I4s", len(text), b"JSON") + text + data[20 + size :]
        (tmp_path / "page.glb").write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
        return tmp_path / "page.glb"

    return export


def test_a_mesh_comes_back_on_its_grid_with_its_picture(exported, shot):
    back, scan = load_scan(exported(rows=24, cols=32)), shot(24, 32)
    seen = back.measured
    np.testing.assert_allclose(back.points[seen], scan.points[seen], atol=HALF_FLOAT_MM, rtol=0)
    np.testing.assert_allclose(back.texture_xy, scan.texture_xy, atol=FLOAT_PX, rtol=0)
    np.testing.assert_array_equal(back.texture, scan.texture)


def test_a_mesh_is_where_its_node_puts_it(exported):
    def shrink(header):
        header["nodes"][0]["matrix"] = [0.001, 0, 0, 0, 0, 0.001, 0, 0, 0, 0, 0.001, 0, 0, 0, 0, 1]

    def grow(header):
        shrink(header)
        header["nodes"].append({"children": [0], "scale": [1000, 1000, 1000]})
        header["scenes"][0]["nodes"] = [len(header["nodes"]) - 1]

    there, back = load_scan(exported()), load_scan(exported(grow))
    np.testing.assert_allclose(back.points, there.points, rtol=1e-12)


def set_in(*keys, value):
    def change(header):
        target = header
        for key in keys[:-1]:
            target = target[key]
        target[keys[-1]] = value

    return change


def drop(*keys):
    def change(header):
        target = header
        for key in keys[:-1]:
            target = target[key]
        del target[keys[-1]]

    return change


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (set_in("accessors", 0, "count", value=10**9), "an array is longer than its buffer view"),
        (set_in("accessors", 0, "count", value=-1), "accessors.0.count"),
        (set_in("accessors", 0, "bufferView", value=99), "an array is longer than its buffer view"),
        (drop("accessors", 0, "bufferView"), "accessors.0.bufferView: Field required"),
        (set_in("bufferViews", 0, "byteLength", value=10**9), "a buffer view ends behind the data"),
        (set_in("bufferViews", 0, "buffer", value=1), "bufferViews.0.buffer"),
        (set_in("meshes", 0, "primitives", 0, "indices", value=77), "uses an array that is not there"),
        (set_in("textures", 0, "source", value=5), "an image that is not there"),
        (set_in("images", 0, value={"uri": "page.png"}), "does not hold its image"),
        (
            set_in("images", 0, "bufferView", value=0),
            "the image inside is not a readable image: its kind is not known",
        ),
        (set_in("nodes", value=[{}] * 1000), "nodes: List should have at most 256"),
        (set_in("scene", value=7), "is not a readable GLB file"),
        (drop("meshes"), "no triangle"),
        (set_in("extensionsRequired", value=["KHR_draco_mesh_compression"]), "extension KHR_draco_mesh_compression"),
        (set_in("extensionsRequired", value=["KHR_materials_unlit", "VENDOR_x"]), "requires the extension VENDOR_x"),
        (set_in("meshes", 0, "primitives", 0, "material", value=9), "a material that is not there"),
        (
            lambda header: header["meshes"][0]["primitives"].extend(header["meshes"][0]["primitives"] * 5000),
            "again and again",
        ),
    ],
)
def test_damage_is_named(exported, change, fault):
    with pytest.raises(BadInput, match=f"page.glb.*{fault}"):
        load_scan(exported(change))


def test_a_part_without_texture_coordinates_is_left_out_and_the_picture_stays(exported):
    def add_bare_part(header):
        primitives = header["meshes"][0]["primitives"]
        attributes = {name: number for name, number in primitives[0]["attributes"].items() if name != "TEXCOORD_0"}
        primitives.append(primitives[0] | {"attributes": attributes})

    there, back = load_scan(exported()), load_scan(exported(add_bare_part))
    np.testing.assert_array_equal(back.texture_xy, there.texture_xy)
    np.testing.assert_array_equal(back.points, there.points)
    assert "faces have no texture coordinates and are skipped" in back.findings[0].text


def test_a_circle_of_nodes_has_an_end(exported):
    there = load_scan(exported(set_in("nodes", value=[{"mesh": 0, "children": [0]}])))
    assert there.measured.any()


def test_another_picture_replaces_the_one_inside(exported, tmp_path):
    Image.new("RGB", (64, 48), (9, 9, 9)).save(tmp_path / "other.png")
    scan = load_scan(exported(set_in("images", 0, value={"uri": "page.png"})), tmp_path / "other.png")
    assert scan.texture.shape == (48, 64, 3)


@pytest.mark.parametrize(
    ("size", "fault"), [(4, "is not a whole glTF 2"), (12, "cut short"), (30, "cut short"), (3000, "cut short")]
)
def test_a_cut_file_is_named(exported, size, fault):
    path = exported()
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(BadInput, match=rf"page\.glb.*{fault}"):
        load_scan(path)


def as_text_in_header(path, uri="data:application/octet-stream;base64,"):
    """The file with its binary chunk as a data URI in the header, as open3d writes it."""
    data = path.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    header, binary = json.loads(data[20 : 20 + size]), data[28 + size :]
    header["buffers"] = [{"byteLength": len(binary), "uri": uri + base64.b64encode(binary).decode()}]
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 20 + len(text)) + struct.pack("<I4s", len(text), b"JSON") + text)
    return path


def test_a_buffer_in_the_header_is_as_good_as_a_binary_chunk(exported):
    whole = load_scan(exported())
    back = load_scan(as_text_in_header(exported()))
    np.testing.assert_array_equal(back.points, whole.points)
    np.testing.assert_array_equal(back.texture, whole.texture)


@pytest.mark.parametrize("uri", ["page.bin,", "data:application/octet-stream,", "data:;base64,=="])
def test_a_buffer_that_is_elsewhere_is_reported(exported, uri):
    with pytest.raises(BadInput, match=r"page\.glb"):
        load_scan(as_text_in_header(exported(), uri))


def test_a_node_that_mirrors_its_mesh_turns_its_faces_round(tmp_path):
    """glTF 2.0, section 3.7.4: where the determinant of a node is negative, the winding of its faces is reversed."""
    corners = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0.01], [0, 0.1, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.Trimesh(corners, faces, process=False), transform=np.diag([-1.0, 1.0, 1.0, 1.0]))
    (tmp_path / "a.glb").write_bytes(scene.export(file_type="glb"))
    found = load_scan(tmp_path / "a.glb")
    a, b, c = found.vertices[found.faces[0]]
    assert np.cross(b - a, c - a)[2] > 0.0
