"""`.glb` and `.gltf`: glTF 2.0, binary, or text with separate files.

`restore.formats.parsing.unit` brings its metres to millimetres.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ValidationError

from restore.errors import BadInput
from restore.findings import Finding
from restore.formats.cleaning.bare_faces import kept_faces
from restore.formats.cleaning.packing import pack
from restore.formats.gltf.glb_attributes import plain_attributes
from restore.formats.gltf.glb_layout import Layout, Requirements
from restore.formats.gltf.gltf_buffers import PLAIN, gathered
from restore.formats.gltf.trimesh_parser import MeshArrays, parse_mesh
from restore.formats.parsing.mesh import PaintedMesh, checked_mesh
from restore.formats.parsing.picture import decode_picture
from restore.formats.parsing.source import CUT_SHORT, DAMAGED, MISSING, read_bytes, without_mark
from restore.scan import Bytes, Ints

# glTF 2.0 specification, "GLB file format specification" and "Accessors".
MAGIC, VERSION, JSON_CHUNK, BINARY_CHUNK = b"glTF", 2, b"JSON", b"BIN\0"
# Interleaved and shared views may be read more than once; a file that multiplies its bytes further is crafted.
MAX_EXPANSION = 8
# The reader applies the first four; the others change how a viewer lights the surface.
KNOWN_EXTENSIONS = {
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "EXT_texture_webp",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_unlit",
}
MAX_NAME = 80  # characters of an extension's name in a message
Model = TypeVar("Model", bound=BaseModel)


def read_glb(path: Path, texture: Bytes | None = None) -> PaintedMesh:
    """Read a mesh with its picture, inside or next to it.

    texture: (h, w, 3), replaces the picture. Raises BadInput.
    """
    return _read(path, *_chunks(path, read_bytes(path)), texture)


def read_gltf(path: Path, texture: Bytes | None = None) -> PaintedMesh:
    """Read a mesh whose header is a separate file, as `read_glb`.

    texture: (h, w, 3). Raises BadInput.
    """
    return _read(path, without_mark(read_bytes(path)), None, texture)


def _read(path: Path, header: bytes, binary: bytes | None, texture: Bytes | None) -> PaintedMesh:
    header, binary = gathered(path, header, binary)
    layout = _layout(path, header, len(binary))
    changed = plain_attributes(path, header, binary, layout)
    arrays = parse_mesh(path, _file(*(changed or (header, binary))), "glb")
    uv, found = arrays.uv, list[Finding]()
    if texture is None and uv is not None:
        texture, uv, found = _packed(path, layout, binary, arrays)
    kept, findings = kept_faces(arrays.bare, pictured=texture is not None)
    uv = None if arrays.bare[kept].any() else uv
    return checked_mesh(
        path,
        arrays.vertices,
        arrays.faces[kept],
        uv=uv,
        texture=texture,
        colours=arrays.colours,
        findings=(*found, *findings),
    )


def _chunks(path: Path, data: bytes) -> tuple[bytes, bytes | None]:
    """Return the JSON and the binary chunk; that may be None."""
    chunks = _all_chunks(path, data)
    if [kind for kind, _ in chunks[:2]] not in ([JSON_CHUNK, BINARY_CHUNK], [JSON_CHUNK]):
        raise BadInput(f"{path} is not made of a JSON header and a binary chunk", DAMAGED)
    return chunks[0][1], chunks[1][1] if len(chunks) > 1 else None


def _all_chunks(path: Path, data: bytes) -> list[tuple[bytes, bytes]]:
    magic, version, length = struct.unpack("<4sII", data[:12].ljust(12, b"\0"))
    if (magic, version) == (MAGIC, VERSION) and length > len(data):
        raise BadInput(f"{path} seems cut short: it has {len(data)} of {length} bytes", CUT_SHORT)
    if (magic, version, length) != (MAGIC, VERSION, len(data)):
        raise BadInput(f"{path} is not a whole glTF 2 binary file", DAMAGED)
    chunks, at = [], 12
    while at + 8 <= len(data):
        length, kind = struct.unpack_from("<I4s", data, at)
        chunks.append((kind, data[at + 8 : at + 8 + length]))
        at += 8 + length
    if at != len(data):
        raise BadInput(f"{path} is not made of a JSON header and a binary chunk", DAMAGED)
    return chunks


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


def _pictures(path: Path, layout: Layout, binary: bytes, used: Ints) -> dict[int, Bytes]:
    """Return the picture of each of the used materials (k,) that has one.

    The same array where they have the same.
    """
    images: dict[int, Bytes] = {}
    found: dict[int, Bytes] = {}
    for material in used:
        base = layout.materials[material].shading.base if 0 <= material < len(layout.materials) else None
        if base is None:
            continue
        try:
            source = layout.textures[base.index].image
            view = None if source is None else layout.images[source].view
            place = None if view is None else layout.views[view]
        except IndexError as error:
            raise BadInput(f"{path}: a material uses an image that is not there", DAMAGED) from error
        if source is None or place is None:
            raise BadInput(f"{path} does not hold its image", MISSING)
        if source not in images:
            data = binary[place.start : place.start + place.length]
            images[source] = decode_picture(data, f"{path}: the image inside")
        found[int(material)] = images[source]
    return found


def _packed(
    path: Path, layout: Layout, binary: bytes, arrays: MeshArrays
) -> tuple[Bytes | None, NDArray[np.float64] | None, list[Finding]]:
    """Return the picture of a mesh, of several packed into one.

    Returns also its texture coordinates (n, 2) there, and findings.
    """
    assert arrays.uv is not None
    of_materials = _pictures(path, layout, binary, np.unique(arrays.materials))
    pictures = list({id(picture): picture for picture in of_materials.values()}.values())
    if len(pictures) < 2:
        return (pictures[0] if pictures else None), arrays.uv, []
    number = {material: [id(one) for one in pictures].index(id(picture)) for material, picture in of_materials.items()}
    picture_of = np.array([number.get(int(material), 0) for material in range(int(arrays.materials.max()) + 1)])
    texture, uv = pack(path, pictures, arrays.uv, picture_of[np.maximum(arrays.materials, 0)], arrays.faces)
    return texture, uv, [Finding.of("pictures_packed", count=len(pictures))]
