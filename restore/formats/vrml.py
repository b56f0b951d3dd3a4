"""`.wrl`: VRML 1.0 as the scanner's own software (VIVID-S, Polygon Editing Tool) writes it.

Coordinates are millimetres in the scanner's frame; the transforms round them are for the viewer and are left out. The
vertices come in raster order, the faces are quadrilaterals and triangles.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from restore.errors import BadInput
from restore.formats.grid import grid_polygons
from restore.formats.mesh import checked_mesh, fan_triangles, split_seams
from restore.formats.picture import encode_png, read_picture
from restore.formats.source import DAMAGED, ONE_SHOT, parse_integers, parse_numbers, read_bytes, resolve_reference
from restore.scan import Bytes, Floats, Ints, RangeScan, SurfaceMesh

HEADER = b"#VRML V1.0 ascii"
_COMMENT = re.compile(rb'("[^"\n]*")|#[^\n\r]*')
_NODE = re.compile(rb"\b(Coordinate3|TextureCoordinate2|IndexedFaceSet|Texture2)\s*\{([^{}]*)\}")
_FILE_NAME = re.compile(rb'\bfilename\s+"([^"]*)"')


def read_vrml(path: Path, texture: Bytes | None = None) -> SurfaceMesh:
    """Read the indexed face sets of a file; `texture` (h, w, 3) replaces the picture that it names. Raises BadInput."""
    data = read_bytes(path)
    if not data.startswith(HEADER):
        raise BadInput(f"{path} is not VRML 1.0 text", "export the scan as VRML 1.0, OBJ or PLY")
    text = _COMMENT.sub(lambda match: match[1] or b"", data)
    pieces = list(_face_sets(path, text))
    if not pieces:
        raise BadInput(f"{path} holds no complete IndexedFaceSet", DAMAGED)
    firsts = np.cumsum([0] + [len(vertices) for vertices, _, _ in pieces])
    vertices = np.concatenate([piece[0] for piece in pieces])
    faces = np.concatenate([piece[1] + first for piece, first in zip(pieces, firsts[:-1], strict=True)])
    uvs = [uv for _, _, uv in pieces if uv is not None]
    uv = np.concatenate(uvs) if len(uvs) == len(pieces) else None
    if texture is None and uv is not None:
        texture = _named_picture(path, text)
    return checked_mesh(path, vertices, faces, uv=uv, texture=texture)


def write_vrml(scan: RangeScan, path: Path) -> None:
    """Write the measured samples as the scanner's software does, with two decimals, and the picture beside as PNG."""
    measured = scan.measured
    points = "".join(map("{:.2f} {:.2f} {:.2f},\n".format, *scan.points[measured].T))
    faces = "".join(", ".join(map(str, face)) + ", -1,\n" for part in grid_polygons(measured) for face in part.tolist())
    path.write_text(
        "#VRML V1.0 ascii\n# VIVID-S\n"
        f"# Object name : {path.stem}\n"
        "Separator {\nTransform { translation 0 0 0 scaleFactor 0.5 0.5 0.5 }\n"
        "Group {\nGroup {\nSeparator {\nTransform { translation 0 0 0 }\n"
        f"Coordinate3 {{ point [\n{points}] }}\n"
        "ShapeHints { vertexOrdering COUNTERCLOCKWISE shapeType UNKNOWN_SHAPE_TYPE faceType CONVEX creaseAngle 0.52 }\n"
        f"IndexedFaceSet {{ coordIndex [\n{faces}] }}\n"
        "}\n}\n}\n}\n",
        encoding="ascii",
        errors="replace",
        newline="\n",
    )
    if scan.texture is not None:
        path.with_suffix(".png").write_bytes(encode_png(scan.texture))


def _face_sets(path: Path, text: bytes) -> Iterator[tuple[Floats, Ints, Floats | None]]:
    """Vertices, triangles and texture coordinates of each face set, which uses the last coordinates before it."""
    vertices, uv = np.empty((0, 3)), np.empty((0, 2))
    for kind, body in _NODE.findall(text):
        if kind == b"Coordinate3":
            vertices = _tuples(path, body, "Coordinate3", 3)
        elif kind == b"TextureCoordinate2":
            uv = _tuples(path, body, "TextureCoordinate2", 2)
        elif kind == b"IndexedFaceSet":
            yield _face_set(path, body, vertices, uv)


def _face_set(path: Path, body: bytes, vertices: Floats, uv: Floats) -> tuple[Floats, Ints, Floats | None]:
    faces = _triangles(path, body, b"coordIndex", len(vertices))
    if not len(uv):
        return vertices, faces, None
    uv_faces = _triangles(path, body, b"textureCoordIndex", len(uv)) if b"textureCoordIndex" in body else faces
    if uv_faces.shape != faces.shape or (faces.size and uv_faces.max() >= len(uv)):
        raise BadInput(f"{path}: the texture coordinates do not match the faces", DAMAGED)
    take, take_uv, faces = split_seams(faces, uv_faces, len(uv))
    return vertices[take], faces, uv[take_uv]


def _triangles(path: Path, body: bytes, field: bytes, count: int) -> Ints:
    indices = parse_integers(_list(path, body, field), path, field.decode())
    ends = np.flatnonzero(indices < 0)  # −1 ends a polygon; the last end may be missing
    starts = np.concatenate([[0], ends + 1])
    if indices.size and indices.max() >= count:
        raise BadInput(f"{path}: {field.decode()} uses number {indices.max()} of {count}", DAMAGED)
    return fan_triangles(indices, starts, np.append(ends, indices.size) - starts)


def _tuples(path: Path, body: bytes, kind: str, width: int) -> Floats:
    values = parse_numbers(_list(path, body, b"point"), path, kind)
    if values.size % width:
        raise BadInput(f"{path}: {kind} holds {values.size} numbers, not a multiple of {width}", DAMAGED)
    return values.reshape(-1, width)


def _list(path: Path, body: bytes, field: bytes) -> bytes:
    match = re.search(rb"\b" + field + rb"\s*\[([^\[\]]*)\]", body)
    if match is None:
        raise BadInput(f"{path}: the list {field.decode()} is missing or does not end", DAMAGED)
    return match[1].replace(b",", b" ")


def _named_picture(path: Path, text: bytes) -> Bytes | None:
    names = {name[1].decode("utf-8", "replace") for _, body in _NODE.findall(text) if (name := _FILE_NAME.search(body))}
    if len(names) > 1:
        raise BadInput(f"{path} uses {len(names)} pictures, a scan has one", ONE_SHOT)
    return read_picture(resolve_reference(path, names.pop())) if names else None
