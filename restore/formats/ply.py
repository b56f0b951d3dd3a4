"""`.ply`: Stanford polygon file, text or binary, with a picture (`comment TextureFile`) or a colour for each vertex."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from restore.errors import BadInput
from restore.formats.mesh import checked_mesh, texture_uv
from restore.formats.picture import encode_png, read_picture
from restore.formats.source import DAMAGED, MISSING, ONE_SHOT, is_file, read_bytes, resolve_reference
from restore.formats.trimesh_parser import parse_mesh
from restore.scan import Bytes, SurfaceMesh

MAX_HEADER_BYTES = 2**16  # a header is a page of text
_HEADER = re.compile(rb"ply\s.*?\nend_header[ \t]*\r?\n", re.DOTALL)
_ELEMENT = re.compile(rb"^element[ \t]+(\w+)[ \t]+(\d{1,10})[ \t]*\r?$", re.MULTILINE)
_PICTURE = re.compile(rb"^comment[ \t]+TextureFile[ \t]+(.*?)[ \t]*\r?$", re.MULTILINE | re.IGNORECASE)


def read_ply(path: Path, texture: Bytes | None = None) -> SurfaceMesh:
    """Read a mesh, its texture coordinates or its colours; `texture` (h, w, 3) replaces its picture.

    Raises BadInput.
    """
    data = read_bytes(path)
    header = _header(path, data)
    arrays = parse_mesh(path, data, "ply", skip_materials=True)
    if texture is None and arrays.uv is not None:
        texture = _picture(path, header)
    return checked_mesh(path, arrays.vertices, arrays.faces, uv=arrays.uv, texture=texture, colours=arrays.colours)


def write_ply(mesh: SurfaceMesh, path: Path) -> None:
    """Write a mesh as binary PLY without loss, and when it has a texture that as .png beside it."""
    fields, columns, comment = ["x", "y", "z"], [mesh.vertices], ""
    if mesh.texture is not None and mesh.texcoords is not None:
        fields, columns = fields + ["s", "t"], columns + [texture_uv(mesh.texcoords, mesh.texture)]
        comment = f"comment TextureFile {path.stem}.png\n"
        path.with_suffix(".png").write_bytes(encode_png(mesh.texture))
    header = (
        f"ply\nformat binary_little_endian 1.0\n{comment}element vertex {len(mesh.vertices)}\n"
        + "".join(f"property double {field}\n" for field in fields)
        + f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.zeros(len(mesh.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    path.write_bytes(header.encode() + np.hstack(columns).astype("<f8").tobytes() + faces.tobytes())


def _header(path: Path, data: bytes) -> bytes:
    """The header, after checking that what it promises is there: trimesh takes what comes in a text file."""
    match = _HEADER.match(data, 0, MAX_HEADER_BYTES)
    if match is None:
        raise BadInput(f"{path} has no PLY header", DAMAGED)
    promised = sum(int(count) for _, count in _ELEMENT.findall(match[0]))
    # A vertex or a face takes a line of text, and in binary form more than a byte.
    available = data.count(b"\n", match.end()) + 1 if b"format ascii" in match[0] else len(data) - match.end()
    if promised > available:
        raise BadInput(f"{path} promises {promised} vertices and faces and ends before", DAMAGED)
    return match[0]


def _picture(path: Path, header: bytes) -> Bytes | None:
    names = {name.decode("utf-8", "replace") for name in _PICTURE.findall(header)}
    if len(names) > 1:
        raise BadInput(f"{path} uses {len(names)} pictures, a scan has one", ONE_SHOT)
    if not names:
        return None
    file = resolve_reference(path, name := names.pop())
    if not is_file(file):
        raise BadInput(f"{path}: its picture {name!r} is missing", MISSING)
    return read_picture(file)
