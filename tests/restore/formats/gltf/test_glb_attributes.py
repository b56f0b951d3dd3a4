"""Texture coordinates and positions of glTF in all their forms show the same picture at the same place."""

import json
import struct

import numpy as np
import pytest
from PIL import Image

from restore.errors import BadInput
from restore.formats.gltf.glb import read_glb
from restore.formats.gltf.glb_attributes import transformed
from restore.formats.gltf.glb_layout import TextureTransform
from restore.formats.parsing.picture import encode_png

POINTS = np.array([[0, 0, 0], [51, 0, 0], [51, 102, 0], [0, 102, 51]]) / 255.0
UV = np.array([[0, 255], [204, 255], [204, 51], [0, 51]]) / 255.0  # v down
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.uint16)
PICTURE = np.arange(60, dtype=np.uint8).reshape(4, 5, 3)
PIXELS = UV * [5, 4] - 0.5
EXACT = 1e-5  # of float32
COMPONENT = {"u1": 5121, "i1": 5120, "<u2": 5123, "<i2": 5122, "<f4": 5126}


def write(path, attributes, use=None, **header):
    """A file of one primitive, its attributes as (array, normalized)."""
    arrays = [(FACES.reshape(-1, 1), False), *attributes.values()]
    blobs = [array.tobytes() + b"\0" * (-array.nbytes % 4) for array, _ in arrays] + [encode_png(PICTURE)]
    starts = np.cumsum([0] + [len(blob) for blob in blobs])
    header = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": int(starts[-1])}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": int(start), "byteLength": len(blob)}
            for start, blob in zip(starts[:-1], blobs, strict=True)
        ],
        "accessors": [
            {
                "bufferView": k,
                "componentType": COMPONENT[array.dtype.str.lstrip("|")],
                "count": len(array),
                "type": {1: "SCALAR", 2: "VEC2", 3: "VEC3"}[array.shape[1]],
                "normalized": normalized,
            }
            for k, (array, normalized) in enumerate(arrays)
        ],
        "images": [{"bufferView": len(blobs) - 1, "mimeType": "image/png"}],
        "textures": [{"source": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0} | (use or {})}}],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {name: k + 1 for k, name in enumerate(attributes)}, "indices": 0, "material": 0}
                ]
            }
        ],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    } | header
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    binary = b"".join(blobs) + b"\0" * (-int(starts[-1]) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
    return path


def floats(values):
    return np.asarray(values, "<f4"), False


def integers(values, dtype):
    return np.rint(np.asarray(values) * np.iinfo(dtype).max).astype(dtype), True


def shows_the_same(path, tolerance=EXACT):
    mesh = read_glb(path)
    np.testing.assert_allclose(mesh.vertices, POINTS, atol=tolerance)
    np.testing.assert_allclose(mesh.texcoords, PIXELS, atol=5 * tolerance)
    np.testing.assert_array_equal(mesh.texture, PICTURE)


@pytest.mark.parametrize("dtype", ["u1", "<u2"])
def test_normalized_texture_coordinates(tmp_path, dtype):
    shows_the_same(write(tmp_path / "a.glb", {"POSITION": floats(POINTS), "TEXCOORD_0": integers(UV, dtype)}))


@pytest.mark.parametrize("dtype, step", [("<u2", EXACT), ("<i2", 2e-5)])  # half a step of 1/32767, at most
def test_normalized_positions(tmp_path, dtype, step):
    attributes = {"POSITION": integers(POINTS, dtype), "TEXCOORD_0": floats(UV)}
    shows_the_same(write(tmp_path / "a.glb", attributes, extensionsRequired=["KHR_mesh_quantization"]), step)


def test_the_set_that_the_picture_uses(tmp_path):
    attributes = {"POSITION": floats(POINTS), "TEXCOORD_0": floats(UV[::-1] / 2), "TEXCOORD_1": floats(UV)}
    shows_the_same(write(tmp_path / "a.glb", attributes, {"texCoord": 1}))
    override = {"extensions": {"KHR_texture_transform": {"texCoord": 1}}}
    shows_the_same(write(tmp_path / "a.glb", attributes, override))


def test_a_transform_is_applied(tmp_path):
    change = {"offset": [0.25, -0.5], "rotation": 0.4, "scale": [2.0, 0.5]}
    sine, cosine = np.sin(0.4), np.cos(0.4)
    before = np.linalg.solve([[cosine, sine], [-sine, cosine]], (UV - change["offset"]).T).T / change["scale"]
    attributes = {"POSITION": floats(POINTS), "TEXCOORD_0": floats(before)}
    use = {"extensions": {"KHR_texture_transform": change}}
    shows_the_same(write(tmp_path / "a.glb", attributes, use, extensionsRequired=["KHR_texture_transform"]))


def test_a_positive_rotation_is_counter_clockwise_as_the_picture_is_seen():
    right = np.array([[1.0, 0.0]])
    np.testing.assert_allclose(transformed(right, TextureTransform(rotation=np.pi / 2)), [[0.0, -1.0]], atol=1e-15)


def test_a_set_that_is_not_there_leaves_no_picture(tmp_path):
    path = write(tmp_path / "a.glb", {"POSITION": floats(POINTS), "TEXCOORD_0": floats(UV)}, {"texCoord": 3})
    assert read_glb(path).texcoords is None


def test_another_picture_is_laid_on_by_the_same_coordinates(tmp_path):
    path = write(tmp_path / "a.glb", {"POSITION": floats(POINTS), "TEXCOORD_0": integers(UV, "<u2")})
    other = np.asarray(Image.new("RGB", (50, 40)))
    np.testing.assert_allclose(read_glb(path, other).texcoords, UV * [50, 40] - 0.5, atol=50 * EXACT)


@pytest.mark.parametrize(
    "change, fault",
    [
        ({"byteOffset": 16}, "longer than its buffer view"),
        ({"type": "VEC3", "count": 2}, "of a type that cannot be"),
    ],
)
def test_an_attribute_that_does_not_fit_is_named(tmp_path, change, fault):
    path = write(tmp_path / "a.glb", {"POSITION": floats(POINTS), "TEXCOORD_0": integers(UV, "<u2")})
    data = path.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    header = json.loads(data[20 : 20 + size])
    header["accessors"][2] |= change
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + size :]
    body = struct.pack("<I4s", len(text), b"JSON") + text + rest
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
    with pytest.raises(BadInput, match=rf"a\.glb: .*{fault}"):
        read_glb(path)
