"""Positions and texture coordinates of glTF primitives as plain floats.

glTF 2.0 specification, "Meshes"; KHR_mesh_quantization and KHR_texture_transform of its extensions.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput
from restore.formats.gltf.glb_layout import COMPONENTS, Accessor, Layout, Primitive, TextureTransform, TextureUse
from restore.formats.parsing.mesh import check_counts
from restore.formats.parsing.source import DAMAGED
from restore.scan import Floats

FLOAT = 5126
TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", FLOAT: "<f4"}
POSITION, TEXCOORD = "POSITION", "TEXCOORD_0"


@dataclass
class Additions:
    """Arrays that are added to a file.

    Its header, and what follows its binary chunk of `size` bytes.
    """

    header: dict[str, Any]
    size: int
    parts: list[bytes] = field(default_factory=list)
    rows: int = 0
    changed: bool = False

    def assign(self, attributes: dict[str, Any], name: str, accessor: int | None) -> None:
        """Give an attribute of a primitive another accessor, or none."""
        self.changed |= attributes.pop(name, None) != accessor
        if accessor is not None:
            attributes[name] = accessor

    def add(self, values: Floats, kind: str) -> int:
        """The number of a new accessor of values (n, k)."""
        data = np.ascontiguousarray(values, "<f4").tobytes()
        views, accessors = self.header["bufferViews"], self.header["accessors"]
        views.append({"buffer": 0, "byteOffset": self.size, "byteLength": len(data)})
        accessors.append({"bufferView": len(views) - 1, "componentType": FLOAT, "count": len(values), "type": kind})
        self.parts.append(data)
        self.size += len(data)
        self.rows += len(values)
        return len(accessors) - 1


def plain_attributes(path: Path, header: bytes, binary: bytes, layout: Layout) -> tuple[bytes, bytes] | None:
    """Return header and binary chunk with float positions, and texture coordinates as set 0.

    None for a file that is so already. Raises BadInput.
    """
    try:
        new = Additions(json.loads(header), len(binary))
    except (ValueError, RecursionError) as error:
        raise BadInput(f"{path}: its header cannot be read: {error}", DAMAGED) from error
    for mesh, described in zip(layout.meshes, new.header.get("meshes", []), strict=True):
        for primitive, changed in zip(mesh.primitives, described["primitives"], strict=True):
            _add_plain(path, layout, binary, primitive, changed["attributes"], new)
            check_counts(path, new.rows, 0)
    if not new.changed:
        return None
    new.header["buffers"] = [{"byteLength": new.size}]
    return json.dumps(new.header).encode(), b"".join([binary, *new.parts])


def _add_plain(
    path: Path, layout: Layout, binary: bytes, primitive: Primitive, attributes: dict[str, Any], new: Additions
) -> None:
    """Point the attributes of a primitive to arrays of floats.

    They are added where the file has others.
    """
    position = primitive.attributes.get(POSITION)
    if position is not None and layout.accessors[position].component != FLOAT:
        new.assign(attributes, POSITION, new.add(_values(path, layout, binary, position, "VEC3"), "VEC3"))
    use = _use(path, layout, primitive)
    transform = use.extensions.transform if use else TextureTransform()
    which = transform.texcoord if transform.texcoord is not None else use.texcoord if use else 0
    texcoord = primitive.attributes.get(f"TEXCOORD_{which}")
    moved = transform != TextureTransform(texCoord=transform.texcoord)
    if texcoord is not None and (moved or layout.accessors[texcoord].component != FLOAT):
        uv = transformed(_values(path, layout, binary, texcoord, "VEC2"), transform)
        texcoord = new.add(uv, "VEC2")
    new.assign(attributes, TEXCOORD, texcoord)


def _use(path: Path, layout: Layout, primitive: Primitive) -> TextureUse | None:
    """The use of the picture by the material of a primitive, if it has one."""
    if primitive.material is None:
        return None
    if primitive.material >= len(layout.materials):
        raise BadInput(f"{path}: a mesh uses a material that is not there", DAMAGED)
    return layout.materials[primitive.material].shading.base


def _values(path: Path, layout: Layout, binary: bytes, number: int, kind: str) -> Floats:
    """The values (n, k) of an accessor; normalized integers become fractions."""
    accessor = layout.accessors[number]
    if accessor.kind != kind or accessor.component not in TYPES:
        raise BadInput(f"{path}: an attribute of a mesh is of a type that cannot be", DAMAGED)
    view, dtype = layout.views[accessor.view], np.dtype(TYPES[accessor.component])
    row = COMPONENTS[kind] * dtype.itemsize
    stride = view.stride or row
    if accessor.start + (accessor.count - 1) * stride + row > view.length:
        raise BadInput(f"{path}: an array is longer than its buffer view", DAMAGED)
    table: NDArray[Any] = np.ndarray(
        (accessor.count, COMPONENTS[kind]), dtype, binary, view.start + accessor.start, (stride, dtype.itemsize)
    )
    return _fractions(table, accessor)


def _fractions(values: NDArray[Any], accessor: Accessor) -> Floats:
    floats = values.astype(np.float64)
    if not accessor.normalized or values.dtype.kind == "f":
        return floats
    return np.maximum(floats / np.iinfo(values.dtype).max, -1.0)


def transformed(uv: Floats, transform: TextureTransform) -> Floats:
    """Texture coordinates (n, 2), v down, scaled, rotated and moved, in this order.

    A positive rotation is counter-clockwise as one sees the picture, v down, as the extension says and its sample model
    shows; the shader in its text turns the other way.
    """
    sine, cosine = np.sin(transform.rotation), np.cos(transform.rotation)
    rotation = np.array([[cosine, sine], [-sine, cosine]])
    return uv * transform.scale @ rotation.T + transform.offset
