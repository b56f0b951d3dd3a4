"""`.glb`: binary glTF 2.0, all in one file. `restore.formats.unit` brings its metres to millimetres."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, ValidationError

from restore.errors import BadInput
from restore.formats.mesh import checked_mesh
from restore.formats.picture import decode_picture
from restore.formats.source import CUT_SHORT, DAMAGED, MISSING, ONE_SHOT, read_bytes
from restore.formats.trimesh_parser import parse_mesh
from restore.scan import Bytes, SurfaceMesh

# glTF 2.0 specification, "GLB file format specification" and "Accessors".
MAGIC, VERSION, JSON_CHUNK, BINARY_CHUNK = b"glTF", 2, b"JSON", b"BIN\0"
COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
# Interleaved and shared views may be read more than once; a file that multiplies its bytes further is crafted.
MAX_EXPANSION = 8
# The header of one textured mesh is a page of text with a node or two; an editor adds some dozens.
MAX_HEADER_BYTES = 2**20
MAX_NODES = 256


class View(BaseModel):
    """A range of bytes of the binary chunk."""

    buffer: Literal[0] = 0
    start: int = Field(default=0, alias="byteOffset", ge=0)
    length: int = Field(alias="byteLength", ge=1)


class Accessor(BaseModel):
    """An array in a view. Without a view it would be zeros from nothing (sparse or compressed data)."""

    view: int = Field(alias="bufferView", ge=0)
    component: int = Field(alias="componentType")
    count: int = Field(ge=1)
    kind: Literal["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"] = Field(alias="type")

    @property
    def size(self) -> int:
        """Size of the array, bytes."""
        return self.count * COMPONENTS[self.kind] * COMPONENT_BYTES.get(self.component, 4)


class Image(BaseModel):
    """A picture in a view, or elsewhere."""

    view: int | None = Field(default=None, alias="bufferView", ge=0)


class Texture(BaseModel):
    """A use of a picture."""

    source: int | None = Field(default=None, ge=0)


class TextureUse(BaseModel):
    """A use of a texture."""

    index: int = Field(ge=0)


class Shading(BaseModel):
    """The part of a material that carries the picture."""

    base: TextureUse | None = Field(default=None, alias="baseColorTexture")


class Material(BaseModel):
    """A material of faces."""

    shading: Shading = Field(default=Shading(), alias="pbrMetallicRoughness")


class Primitive(BaseModel):
    """A mesh: the arrays of its vertices and of its faces."""

    attributes: dict[str, Annotated[int, Field(ge=0)]]
    indices: int | None = Field(default=None, ge=0)

    @property
    def arrays(self) -> list[int]:
        """All arrays that it reads."""
        return [*self.attributes.values(), *([] if self.indices is None else [self.indices])]


class Mesh(BaseModel):
    """Some primitives."""

    primitives: list[Primitive]


class Layout(BaseModel):
    """The parts of a glTF header that are validated before any array is read."""

    views: list[View] = Field(default=[], alias="bufferViews")
    accessors: list[Accessor] = []
    meshes: list[Mesh] = []
    nodes: list[dict[str, Any]] = Field(default=[], max_length=MAX_NODES)
    images: list[Image] = []
    textures: list[Texture] = []
    materials: list[Material] = []


def read_glb(path: Path, texture: Bytes | None = None) -> SurfaceMesh:
    """Read a mesh with its embedded picture, which `texture` (h, w, 3) replaces. Raises BadInput."""
    data = read_bytes(path)
    header, binary = _chunks(path, data)
    layout = _layout(path, header, len(binary))
    arrays = parse_mesh(path, data, "glb")
    if texture is None and arrays.uv is not None:
        texture = _picture(path, layout, binary)
    return checked_mesh(path, arrays.vertices, arrays.faces, uv=arrays.uv, texture=texture, colours=arrays.colours)


def _chunks(path: Path, data: bytes) -> tuple[bytes, bytes]:
    """The JSON and the binary chunk."""
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
    kinds = [kind for kind, _ in chunks[:2]]
    if kinds != [JSON_CHUNK, BINARY_CHUNK] or at != len(data) or len(chunks[0][1]) > MAX_HEADER_BYTES:
        raise BadInput(f"{path} is not made of a JSON header and a binary chunk", DAMAGED)
    return chunks[0][1], chunks[1][1]


def _layout(path: Path, header: bytes, binary: int) -> Layout:
    try:
        layout = Layout.model_validate_json(header)
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(map(str, fault["loc"])) or "its header"
        raise BadInput(f"{path}: {where}: {fault['msg']}", "export it as a plain, uncompressed .glb") from error
    if any(view.start + view.length > binary for view in layout.views):
        raise BadInput(f"{path}: a buffer view ends behind the data", DAMAGED)
    if any(a.view >= len(layout.views) or a.size > layout.views[a.view].length for a in layout.accessors):
        raise BadInput(f"{path}: an array is longer than its buffer view", DAMAGED)
    _check_reads(path, layout, binary)
    return layout


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
