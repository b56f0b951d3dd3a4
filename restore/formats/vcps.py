"""`.vcps`: ordered point sets of Volume Cartographer, in voxels.

They are segments of CT volumes.

A header of text, `key: value` on every line: width, height, dim (numbers of a point), ordered, type (float, double or
int) and version; a line `<>` ends it. Then the points row by row, as little-endian binary numbers or as text. The first
three numbers of a point are its position; further ones are not read. Points without a position are (−1, −1, −1), all
zero, or not finite.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput
from restore.formats.parsing.picture import adjacent_picture
from restore.formats.parsing.source import CUT_SHORT, DAMAGED, parse_numbers, read_bytes
from restore.formats.segment import MAX_SEGMENT_POINTS, check_segment, segment_mesh
from restore.mesh.ordered_grid import GridMesh
from restore.scan import Bytes

MAX_HEADER_BYTES = 4096  # six short lines, and comments
MAX_DIM = 9  # a position, a normal and a colour
MAX_BYTES = MAX_SEGMENT_POINTS * 6 * 8 + MAX_HEADER_BYTES  # with normals, of double precision
VERSION = 1
TYPES = {"float": "<f4", "double": "<f8", "int": "<i4"}
ABSENT = -1.0
_END = re.compile(rb"^[ \t]*<>[ \t\r]*\n", re.MULTILINE)
_TEXT = re.compile(rb"[\s0-9eE+\-.nNaAiIfF]{1,256}")


def read_vcps(path: Path, texture: Bytes | None = None) -> GridMesh:
    """Read a segment, in voxels, with its texture of the whole grid.

    texture: (h, w, 3), else the picture next to the file.
    Raises BadInput.
    """
    data = read_bytes(path, MAX_BYTES)
    end = _END.search(data, 0, MAX_HEADER_BYTES)
    if end is None:
        raise BadInput(f"{path} is not an ordered point set: its header does not end with <>", DAMAGED)
    fields = _fields(data[: end.start()])
    if fields.get("ordered", "").lower() != "true":
        raise BadInput(f"{path} is a cloud of points without an order", "export the segment as an ordered point set")
    kind = fields.get("type", "")
    if kind not in TYPES:
        raise BadInput(f"{path}: its points are of the type {kind[:40]!r}", f"use one of: {', '.join(TYPES)}")
    if fields.get("version", str(VERSION)) != str(VERSION):
        raise BadInput(f"{path} is of version {fields['version'][:40]!r}, not {VERSION}", "export it again")
    cols, rows, dim = (_count(path, fields, name) for name in ("width", "height", "dim"))
    check_segment(path, rows, cols)
    if not 3 <= dim <= MAX_DIM:
        raise BadInput(f"{path}: its points have {dim} numbers each", "export points of three numbers")
    values = _values(path, data[end.end() :], rows * cols * dim, np.dtype(TYPES[kind]))
    points = values.reshape(rows, cols, dim)[..., :3].astype(np.float64)
    absent = (points == ABSENT).all(axis=2) | (points == 0.0).all(axis=2)
    return segment_mesh(path, points, ~absent, adjacent_picture(path) if texture is None else texture)


def _fields(header: bytes) -> dict[str, str]:
    lines = (line.strip() for line in header.decode("latin-1").split("\n"))
    pairs = (line.partition(":") for line in lines if not line.startswith("#"))
    return {key.strip(): value.strip() for key, _, value in pairs}


def _count(path: Path, fields: dict[str, str], name: str) -> int:
    text = fields.get(name, "")
    if not re.fullmatch(r"[0-9]{1,9}", text):
        raise BadInput(f"{path}: its header gives the {name} as {text[:40]!r}", DAMAGED)
    return int(text)


def _values(path: Path, body: bytes, count: int, dtype: np.dtype[np.generic]) -> NDArray[np.generic]:
    """The numbers (count,) of a body, binary or text."""
    if len(body) == count * dtype.itemsize:
        return np.frombuffer(body, dtype)
    if (start := _TEXT.match(body)) and start.end() == min(len(body), 256):
        values = parse_numbers(body, path, "the point set")
        if values.size == count:
            return values
        raise BadInput(f"{path} holds {values.size} numbers, its points need {count}", CUT_SHORT)
    if len(body) < count * dtype.itemsize:
        raise BadInput(f"{path} seems cut short: {len(body)} of {count * dtype.itemsize} bytes are there", CUT_SHORT)
    raise BadInput(f"{path} holds {len(body)} bytes, its points need {count * dtype.itemsize}", DAMAGED)
