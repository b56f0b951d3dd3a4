"""`.stl`: triangles without colour, text or binary, each with corners of its own."""

from __future__ import annotations

from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput
from restore.formats.mesh import check_counts, check_vertices, checked_mesh
from restore.formats.source import CUT_SHORT, DAMAGED, parse_numbers, read_bytes
from restore.scan import Bytes, Floats, SurfaceMesh

HEADER_BYTES = 84  # 80 of any text, then the number of triangles
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
VERTEX, END = b"vertex", b"endsolid"
_VERTEX = np.frombuffer(VERTEX, np.uint8)
NEWLINE, BLANK = 10, 32


def read_stl(path: Path, texture: Bytes | None = None) -> SurfaceMesh:
    """Read the triangles and join corners at the same place to one vertex; `texture` (h, w, 3). Raises BadInput."""
    data = read_bytes(path)
    count = int.from_bytes(data[HEADER_BYTES - 4 : HEADER_BYTES], "little")
    expected = HEADER_BYTES + count * TRIANGLE.itemsize
    if len(data) >= HEADER_BYTES and len(data) == expected:
        corners = _binary_corners(path, data, count)
    elif data.lstrip()[:5].lower() == b"solid":
        corners = _text_corners(path, data)
    elif len(data) < expected:
        raise BadInput(
            f"{path} seems cut short: it has {len(data)} bytes, {count} triangles need {expected}", CUT_SHORT
        )
    else:
        raise BadInput(f"{path} has {len(data)} bytes, its {count} triangles need {expected}", DAMAGED)
    check_vertices(path, corners)
    vertices, number = _join(corners)
    return checked_mesh(path, vertices, number.reshape(-1, 3), texture=texture)


def _binary_corners(path: Path, data: bytes, count: int) -> Floats:
    """The corners (3m, 3) of a binary file."""
    check_counts(path, 0, count)
    with np.errstate(invalid="ignore"):  # of a NaN that signals, which is refused below
        return np.frombuffer(data, TRIANGLE, count, HEADER_BYTES)["corners"].reshape(-1, 3).astype(np.float64)


def _text_corners(path: Path, data: bytes) -> Floats:
    """The corners (3m, 3) of a text file: the numbers behind each word `vertex`."""
    lower = data.lower()
    if lower.rfind(END) < lower.rfind(VERTEX):
        raise BadInput(f"{path} seems cut short: it does not end with {END.decode()}", CUT_SHORT)
    check_counts(path, 0, lower.count(VERTEX) // 3)
    numbers = np.empty(len(data) + 1, np.uint8)
    used = _vertex_numbers(np.frombuffer(lower, np.uint8), numbers)
    values = parse_numbers(numbers[:used].tobytes(), path, "a vertex")
    if values.size % 9:
        raise BadInput(f"{path} has {values.size} coordinates, triangles have nine each", DAMAGED)
    return values.reshape(-1, 3)


@numba.njit(cache=True)
def _vertex_numbers(text: NDArray[np.uint8], numbers: NDArray[np.uint8]) -> int:
    """Copy what follows each word `vertex` on its line, with a blank behind it. Returns how many bytes that are."""
    used, at = 0, 0
    while at + len(_VERTEX) <= len(text):
        k = 0
        while k < len(_VERTEX) and text[at + k] == _VERTEX[k]:
            k += 1
        if k < len(_VERTEX):
            at += 1
            continue
        at += len(_VERTEX)
        while at < len(text) and text[at] != NEWLINE:
            numbers[used] = text[at]
            used, at = used + 1, at + 1
        numbers[used] = BLANK
        used += 1
    return used


def _join(corners: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """The distinct positions (n, 3) mm of corners (c, 3), and the number of each corner among them (c,)."""
    order = np.lexsort(corners.T)
    new = np.empty(len(order), bool)
    new[:1] = True
    ordered = corners[order]
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    number = np.empty(len(order), np.int64)
    number[order] = np.cumsum(new) - 1
    return ordered[new], number
