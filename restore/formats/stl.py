"""`.stl`: triangles without colour, text or binary, each with corners of its own."""

from __future__ import annotations

import re
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput
from restore.findings import Finding
from restore.formats.parsing.mesh import PaintedMesh, check_counts, checked_mesh
from restore.formats.parsing.source import CUT_SHORT, DAMAGED, parse_numbers, read_bytes, with_newlines, without_mark
from restore.scan import Bytes, Floats

HEADER_BYTES = 84  # 80 of any text, then the number of triangles
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attributes", "<u2")])
UNCOUNTED = (0, 2**32 - 1)  # what a program leaves in the header that writes triangles as they come
VERTEX = b"vertex"
_VERTEX = np.frombuffer(VERTEX, np.uint8)
_NAMED = re.compile(rb"^([ \t]*(?:end[ \t]*)?solid)\b.*$", re.MULTILINE)  # a name may hold any word
_END = re.compile(rb"end[ \t]*solid")
_TEXT = re.compile(rb"solid[^\n]*(\n[ -~\s]*)?")  # its name may have any letters; numbers have other bytes than these
TEXT_BYTES = 1024  # enough to distinguish text from numbers
NEWLINE, BLANK = 10, 32


def read_stl(path: Path, texture: Bytes | None = None) -> PaintedMesh:
    """Read the triangles and join corners at the same place.

    They become one vertex. A finding reports a number of triangles in the header that is not that of the file, and data
    behind them.
    texture: (h, w, 3).
    Raises BadInput.
    """
    data = read_bytes(path)
    corners, found = _text_corners(path, data) if _is_text(data) else _binary_corners(path, data)
    vertices, number = _join(corners)
    return checked_mesh(path, vertices, number.reshape(-1, 3), texture=texture, findings=found)


def _is_text(data: bytes) -> bool:
    """Whether a file is text. Headers of binary files begin with `solid`, too."""
    start = with_newlines(without_mark(data[:TEXT_BYTES])).lstrip().rstrip(b"\0\x1a").lower()
    found = _TEXT.fullmatch(start)
    return found is not None and (found[1] is not None or len(start) < HEADER_BYTES)


def _binary_corners(path: Path, data: bytes) -> tuple[Floats, list[Finding]]:
    """The corners (3m, 3) of a binary file, and findings."""
    count, found = _count(path, data)
    check_counts(path, 0, count)
    with np.errstate(invalid="ignore"):  # of a NaN that signals, which is refused below
        corners = np.frombuffer(data, TRIANGLE, count, HEADER_BYTES)["corners"].reshape(-1, 3).astype(np.float64)
    return corners, found


def _count(path: Path, data: bytes) -> tuple[int, list[Finding]]:
    count = int.from_bytes(data[HEADER_BYTES - 4 : HEADER_BYTES], "little")
    expected = HEADER_BYTES + count * TRIANGLE.itemsize
    held, behind = divmod(len(data) - HEADER_BYTES, TRIANGLE.itemsize)
    if len(data) >= HEADER_BYTES and len(data) == expected:
        return count, []
    if held > 0 and behind == 0 and (count in UNCOUNTED or count < held):
        return held, [Finding.of("counts_differ", count=count, held=held)]
    if len(data) < expected:
        raise BadInput(
            f"{path} seems cut short: it has {len(data)} bytes, {count} triangles need {expected}", CUT_SHORT
        )
    if count == 0:
        raise BadInput(f"{path} has {len(data)} bytes, its {count} triangles need {expected}", DAMAGED)
    return count, [Finding.of("bytes_left_out", count=len(data) - expected, triangles=count)]


def _text_corners(path: Path, data: bytes) -> tuple[Floats, list[Finding]]:
    """Return the corners (3m, 3) of a text file, and findings.

    They are the numbers behind each word `vertex`.
    """
    lower = _NAMED.sub(rb"\1", with_newlines(without_mark(data)).lower())
    ends = [end.start() for end in _END.finditer(lower)]
    if not ends or ends[-1] < lower.rfind(VERTEX):
        raise BadInput(f"{path} seems cut short: it does not end with endsolid", CUT_SHORT)
    check_counts(path, 0, lower.count(VERTEX) // 3)
    numbers = np.empty(len(lower) + 1, np.uint8)
    used = _vertex_numbers(np.frombuffer(lower, np.uint8), numbers)
    words, found = numbers[:used].tobytes(), list[Finding]()
    if b"," in words and b"." not in words:
        words, found = words.replace(b",", b"."), [Finding.of("decimal_commas")]
    values = parse_numbers(words, path, "a vertex")
    if values.size % 9:
        raise BadInput(f"{path} has {values.size} coordinates, triangles have nine each", DAMAGED)
    return values.reshape(-1, 3), found


@numba.njit(cache=True)
def _vertex_numbers(text: NDArray[np.uint8], numbers: NDArray[np.uint8]) -> int:
    """Copy the rest of the line of each word `vertex`, with a blank.

    Returns the number of bytes.
    """
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
    """Return the distinct positions (n, 3) mm of corners (c, 3).

    Returns also the number of each corner among them (c,).
    """
    order = np.lexsort(corners.T)
    new = np.empty(len(order), bool)
    new[:1] = True
    ordered = corners[order]
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    number = np.empty(len(order), np.int64)
    number[order] = np.cumsum(new) - 1
    return ordered[new], number
