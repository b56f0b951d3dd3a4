"""`.wrl`: VRML 1.0 as VIVID-S and the Polygon Editing Tool write it.

Coordinates are millimetres in the scanner's frame; the transforms round them are for the viewer and are left out. The
vertices come in raster order, the faces are quadrilaterals and triangles.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

import numba
import numpy as np

from restore.errors import BadInput
from restore.formats.parsing.grid import grid_polygons
from restore.formats.parsing.mesh import (
    PaintedMesh,
    check_counts,
    check_polygons,
    checked_mesh,
    colours_from,
    fan_triangles,
    split_seams,
)
from restore.formats.parsing.picture import encode_png, read_image
from restore.formats.parsing.source import (
    CUT_SHORT,
    DAMAGED,
    ONE_SHOT,
    parse_integers,
    parse_numbers,
    read_bytes,
    resolve_reference,
)
from restore.scan import Bytes, Floats, Ints, RangeScan

HEADER = b"#VRML V1.0 ascii"
MAX_PIECES = 1000  # of a file; the scanner's software writes one, or one for each of its shots
NEWLINE, RETURN, BLANK, QUOTE, HASH = b'\n\r "#'
_NODE = re.compile(
    rb"\b(Coordinate3|TextureCoordinate2|IndexedFaceSet|Texture2|Material|MaterialBinding)\s*\{([^{}]*)\}"
)
_FILE_NAME = re.compile(rb'\bfilename\s+"([^"]*)"')


def read_vrml(path: Path, texture: Bytes | None = None) -> PaintedMesh:
    """Read the indexed face sets of a file.

    texture: (h, w, 3), replaces the picture that it names.
    Raises BadInput.
    """
    data = read_bytes(path)
    if not data.startswith(HEADER):
        raise BadInput(f"{path} is not VRML 1.0 text", "export the scan as VRML 1.0, OBJ or PLY")
    text = _without_comments(data)
    if text.count(b"{") > text.count(b"}") or text.count(b"[") > text.count(b"]"):
        raise BadInput(f"{path} seems cut short: a bracket does not end", CUT_SHORT)
    pieces = _face_sets(path, text)
    vertices, faces, uv = np.concatenate(pieces.vertices), np.concatenate(pieces.faces), None
    known = [part for part in pieces.colours if part is not None]
    colours: Bytes | None = np.concatenate(known) if len(known) == len(pieces.colours) else None
    if len(pieces.uv_faces) == len(pieces.faces):  # all face sets have texture coordinates
        uv = np.concatenate(pieces.uv)
        take, take_uv, faces = split_seams(faces, np.concatenate(pieces.uv_faces), len(uv))
        vertices, uv = vertices[take], uv[take_uv]
        colours = None if colours is None else colours[take]
    if texture is None and uv is not None:
        texture = _named_picture(path, text)
    return checked_mesh(path, vertices, faces, uv=uv, texture=texture, colours=colours)


def write_vrml(scan: RangeScan, path: Path) -> None:
    """Write the measured samples with two decimals, and the picture next to it as PNG."""
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


@dataclass
class Pieces:
    """Coordinates of a file, (n, 3) and (t, 2) each, and its face sets.

    Triangles (m, 3) of each face set count among all of them together.
    colours: (n, 3), of the vertices, None where they have none.
    materials: (k, 3), of the next face set.
    """

    vertices: list[Floats] = field(default_factory=list)
    uv: list[Floats] = field(default_factory=list)
    faces: list[Ints] = field(default_factory=list)
    uv_faces: list[Ints] = field(default_factory=list)
    colours: list[Bytes | None] = field(default_factory=list)
    materials: Floats | None = None
    by_vertex: bool = False


def _without_comments(data: bytes) -> bytes:
    text = np.frombuffer(data, np.uint8).copy()
    _blank_comments(text)
    return text.tobytes()


@numba.njit(cache=True)
def _blank_comments(text: Bytes) -> None:
    """Overwrite comments with blanks.

    They begin with # outside quotes and end with their line; so does a quote.
    """
    quoted, comment = False, False
    for k in range(len(text)):
        if text[k] == NEWLINE or text[k] == RETURN:
            quoted, comment = False, False
        elif comment:
            text[k] = BLANK
        elif text[k] == QUOTE:
            quoted = not quoted
        elif text[k] == HASH and not quoted:
            text[k], comment = BLANK, True


def _face_sets(path: Path, text: bytes) -> Pieces:
    """The face sets, each of which uses the last coordinates before it."""
    pieces, first, first_uv = Pieces(), 0, 0
    for node in _NODE.finditer(text):
        kind, body = node.groups()
        if kind == b"Coordinate3":
            first = sum(map(len, pieces.vertices))
            pieces.vertices.append(_tuples(path, body, "Coordinate3", 3))
            pieces.colours.append(None)
        elif kind == b"TextureCoordinate2":
            first_uv = sum(map(len, pieces.uv))
            pieces.uv.append(_tuples(path, body, "TextureCoordinate2", 2))
        elif kind == b"Material":
            pieces.materials = _diffuse(path, body)
        elif kind == b"MaterialBinding":
            pieces.by_vertex = b"PER_VERTEX" in body
        elif kind == b"IndexedFaceSet":
            _add_faces(path, body, pieces, first, first_uv)
        if max(len(pieces.vertices), len(pieces.uv), len(pieces.faces)) > MAX_PIECES:
            raise BadInput(f"{path} has more than {MAX_PIECES} face sets", ONE_SHOT)
    if not pieces.faces:
        raise BadInput(f"{path} holds no complete IndexedFaceSet", DAMAGED)
    return pieces


def _add_faces(path: Path, body: bytes, pieces: Pieces, first: int, first_uv: int) -> None:
    """Add the triangles of one face set.

    Its vertices and texture coordinates begin at the numbers given.
    """
    vertices, uv = (part[-1] if part else np.empty((0, 0)) for part in (pieces.vertices, pieces.uv))
    faces = _triangles(path, body, b"coordIndex", len(vertices))
    if len(uv):
        uv_faces = _triangles(path, body, b"textureCoordIndex", len(uv)) if b"textureCoordIndex" in body else faces
        if uv_faces.shape != faces.shape or (faces.size and uv_faces.max() >= len(uv)):
            raise BadInput(f"{path}: the texture coordinates do not match the faces", DAMAGED)
        pieces.uv_faces.append(uv_faces + first_uv)
    if pieces.by_vertex and pieces.materials is not None and len(pieces.materials) == len(vertices):
        numbered = b"materialIndex" not in body or np.array_equal(
            _triangles(path, body, b"materialIndex", len(vertices)), faces
        )
        pieces.colours[-1] = colours_from(pieces.materials) if numbered else None
    pieces.faces.append(faces + first)
    check_counts(path, 0, sum(map(len, pieces.faces)))


def _triangles(path: Path, body: bytes, field: bytes, count: int) -> Ints:
    indices = parse_integers(_list(path, body, field), path, field.decode()).astype(np.int32)
    ends = np.flatnonzero(indices < 0).astype(np.int32)  # −1 ends a polygon; the last end may be missing
    starts = np.concatenate([[0], ends + 1]).astype(np.int32)
    if indices.size and indices.max() >= count:
        raise BadInput(f"{path}: {field.decode()} uses number {indices.max()} of {count}", DAMAGED)
    sizes = np.append(ends, np.int32(indices.size)) - starts
    check_polygons(path, sizes)
    return fan_triangles(indices, starts, sizes)


def _diffuse(path: Path, body: bytes) -> Floats | None:
    """The colours (k, 3), fractions of 1, of a list of materials; None for a single one."""
    return _tuples(path, body, "Material", 3, b"diffuseColor") if re.search(rb"\bdiffuseColor\s*\[", body) else None


def _tuples(path: Path, body: bytes, kind: str, width: int, field: bytes = b"point") -> Floats:
    values = parse_numbers(_list(path, body, field), path, kind)
    if values.size % width:
        raise BadInput(f"{path}: {kind} holds {values.size} numbers, not a multiple of {width}", DAMAGED)
    return values.reshape(-1, width)


def _list(path: Path, body: bytes, field: bytes) -> bytes:
    match = re.search(rb"\b" + field + rb"\s*\[([^\[\]]*)\]", body)
    if match is None:
        raise BadInput(f"{path}: the list {field.decode()} is missing or does not end", DAMAGED)
    return match[1].replace(b",", b" ")


def _named_picture(path: Path, text: bytes) -> Bytes | None:
    bodies = (node[2] for node in _NODE.finditer(text) if node[1] == b"Texture2")
    names = {name[1].decode("utf-8", "replace") for body in bodies if (name := _FILE_NAME.search(body))}
    if len(names) > 1:
        raise BadInput(f"{path} uses {len(names)} images, a scan has one", ONE_SHOT)
    return read_image(resolve_reference(path, names.pop())) if names else None
