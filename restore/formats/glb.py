"""`.glb`: binary glTF 2.0, all in one file. `restore.formats.unit` brings its metres to millimetres."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from restore.errors import BadInput
from restore.formats.bare_faces import kept_faces
from restore.formats.glb_attributes import plain_attributes
from restore.formats.glb_layout import Layout, Requirements
from restore.formats.mesh import checked_mesh
from restore.formats.picture import decode_picture
from restore.formats.source import CUT_SHORT, DAMAGED, MISSING, ONE_SHOT, read_bytes
from restore.formats.trimesh_parser import parse_mesh
from restore.scan import Bytes, SurfaceMesh

# glTF 2.0 specification, "GLB file format specification" and "Accessors".
MAGIC, VERSION, JSON_CHUNK, BINARY_CHUNK = b"glTF", 2, b"JSON", b"BIN\0"
# Interleaved and shared views may be read more than once; a file that multiplies its bytes further is crafted.
MAX_EXPANSION = 8
# The header of one textured mesh is a page of text with a node or two; an editor adds some dozens.
MAX_HEADER_BYTES = 2**20
# The reader applies the first two; the others change how a viewer lights the surface.
KNOWN_EXTENSIONS = {
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_unlit",
}
MAX_NAME = 80  # characters of an extension's name in a message
PLAIN = "export it as a plain, uncompressed .glb"
Model = TypeVar("Model", bound=BaseModel)


def read_glb(path: Path, texture: Bytes | None = None) -> SurfaceMesh:
    """Read a mesh with its embedded picture, which `texture` (h, w, 3) replaces. Raises BadInput."""
    data = read_bytes(path)
    if len(chunks := _all_chunks(path, data)) == 1:  # as open3d writes it
        data = _file(*_embedded(path, chunks[0][1]))
    header, binary = _chunks(path, data)
    layout = _layout(path, header, len(binary))
    changed = plain_attributes(path, header, binary, layout)
    arrays = parse_mesh(path, data if changed is None else _file(*changed), "glb")
    if texture is None and arrays.uv is not None:
        texture = _picture(path, layout, binary)
    kept, findings = kept_faces(arrays.bare, pictured=texture is not None)
    uv = None if arrays.bare[kept].any() else arrays.uv
    return checked_mesh(
        path, arrays.vertices, arrays.faces[kept], uv=uv, texture=texture, colours=arrays.colours, findings=findings
    )


def _chunks(path: Path, data: bytes) -> tuple[bytes, bytes]:
    """The JSON and the binary chunk."""
    chunks = _all_chunks(path, data)
    if [kind for kind, _ in chunks[:2]] != [JSON_CHUNK, BINARY_CHUNK] or len(chunks[0][1]) > MAX_HEADER_BYTES:
        raise BadInput(f"{path} is not made of a JSON header and a binary chunk", DAMAGED)
    return chunks[0][1], chunks[1][1]


def _all_chunks(path: Path, data: bytes) -> list[tuple[bytes, bytes]]:
    """The kind of each chunk and its bytes."""
    magic, version, length = struct.unpack("<4sII", data[:12].ljust(12, b"\0"))
    if (magic, version) == (MAGIC, VERSION) and length > len(data):
        raise BadInput(f"{path} seems cut short: it has {len(data)} of {length} bytes", CUT_SHORT)
    if (magic, version, length) != (MAGIC, VERSION, len(data)):
        raise BadInput(f"{path} is no whole glTF 2 binary file", DAMAGED)
    chunks, at = [], 12
    while at + 8 <= len(data):
        length, kind = struct.unpack_from("<I4s", data, at)
        chunks.append((kind, data[at + 8 : at + 8 + length]))
        at += 8 + length
    if at != len(data):
        raise BadInput(f"{path} is not made of a JSON header and a binary chunk", DAMAGED)
    return chunks


def _embedded(path: Path, header: bytes) -> tuple[bytes, bytes]:
    """The header and the binary chunk of a file that has its one buffer as text in the header (a data URI)."""
    try:
        described = json.loads(header)
        (buffer,) = described["buffers"]
        kind, _, text = buffer.pop("uri").partition(",")
        if not (kind.startswith("data:") and kind.endswith(";base64")):
            raise ValueError(f"a buffer is {kind[:MAX_NAME]!r}")
        return json.dumps(described).encode(), base64.b64decode(text, validate=True)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise BadInput(f"{path} holds no binary chunk, and no buffer in its header: {error}", PLAIN) from error


def _file(header: bytes, binary: bytes) -> bytes:
    """A file of a JSON and a binary chunk, the inverse of `_chunks`."""
    padded = ((JSON_CHUNK, header + b" " * (-len(header) % 4)), (BINARY_CHUNK, binary + b"\0" * (-len(binary) % 4)))
    body = b"".join(struct.pack("<I4s", len(chunk), kind) + chunk for kind, chunk in padded)
    return struct.pack("<4sII", MAGIC, VERSION, 12 + len(body)) + body


def _layout(path: Path, header: bytes, binary: int) -> Layout:
    unknown = sorted(set(_validated(path, Requirements, header).extensions) - KNOWN_EXTENSIONS)
    if unknown:
        raise BadInput(f"{path} requires the extension {unknown[0][:MAX_NAME]}, which is not known", PLAIN)
    layout = _validated(path, Layout, header)
    if any(view.start + view.length > binary for view in layout.views):
        raise BadInput(f"{path}: a buffer view ends behind the data", DAMAGED)
    if any(a.view >= len(layout.views) or a.size > layout.views[a.view].length for a in layout.accessors):
        raise BadInput(f"{path}: an array is longer than its buffer view", DAMAGED)
    _check_reads(path, layout, binary)
    return layout


def _validated(path: Path, model: type[Model], header: bytes) -> Model:
    try:
        return model.model_validate_json(header)
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(map(str, fault["loc"])) or "its header"
        raise BadInput(f"{path}: {where}: {fault['msg']}", PLAIN) from error


def _check_reads(path: Path, layout: Layout, binary: int) -> None:
    reads = [array for mesh in layout.meshes for primitive in mesh.primitives for array in primitive.arrays]
    if max(reads, default=0) >= len(layout.accessors):
        raise BadInput(f"{path}: a mesh uses an array that is not there", DAMAGED)
    read = sum(accessor.size for accessor in layout.accessors) + sum(layout.accessors[array].size for array in reads)
    if read > MAX_EXPANSION * binary:
        raise BadInput(f"{path} reads the same bytes again and again", DAMAGED)


def _picture(path: Path, layout: Layout, binary: bytes) -> Bytes | None:
    uses = {material.shading.base.index for material in layout.materials if material.shading.base}
    if len(uses) > 1:
        raise BadInput(f"{path} uses {len(uses)} pictures, a scan has one", ONE_SHOT)
    if not uses:
        return None
    try:
        source = layout.textures[uses.pop()].source
        view = None if source is None else layout.images[source].view
        place = None if view is None else layout.views[view]
    except IndexError as error:
        raise BadInput(f"{path}: a material uses a picture that is not there", DAMAGED) from error
    if place is None:
        raise BadInput(f"{path} does not hold its picture", MISSING)
    return decode_picture(binary[place.start : place.start + place.length], f"{path}: the picture inside")
