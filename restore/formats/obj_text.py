"""Parser of Wavefront text; time and memory are linear in the size of the file."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput
from restore.formats.parsing.mesh import MAX_CORNERS, Numbers, check_counts
from restore.formats.parsing.source import CUT_SHORT, DAMAGED, ONE_SHOT, parse_numbers
from restore.runtime.threads import in_threads
from restore.scan import Bytes, Floats, Ints

PARTS = 4  # two for each thread, as lines of one kind take longer than those of another
PART_BYTES = 2**20  # a smaller part costs more for the thread than it saves
MAX_NAMES = 1000  # of materials, and of material files; a scan has one of each
EXACT_DIGITS = 2**53  # whole numbers below are exact in float64, and so is their product …
EXACT_POWER = 22  # … with or quotient by a power of ten up to this one (W. Clinger, PLDI 1990)
POWERS = 10.0 ** np.arange(EXACT_POWER + 1)
MIN_VERTEX_BYTES = len(b"v 0 0 0\n")  # more vertex lines than fit would take many times the memory of the file
VALUES = 7  # x y z r g b a, or x y z w r g b: more numbers on a line are left out
KINDS = VERTEX, TEXCOORD, FACE, LIBRARY, MATERIAL = range(5)
NUMBER_FAULT, CORNER_FAULT, INDEX_FAULT, COUNT_FAULT = 1, 2, 3, 4
TAB, NEWLINE, RETURN, BLANK, HASH, SLASH, MINUS, PLUS, POINT = 9, 10, 13, 32, 35, 47, 45, 43, 46
ZERO, NINE, LOWER_E, UPPER_E = 48, 57, 101, 69


@dataclass(frozen=True, eq=False)
class ObjText:
    """Contents of an OBJ file.

    vertices  (n, 3) positions.
    others    (n, 4) the numbers behind, NaN where the line has fewer.
    uv        (t, 2) texture coordinates.
    corners   (c,) vertex of each corner of each face, in the order of the file.
    uvs       (c,) its texture coordinate, −1 where it has none.
    sizes     (m,) corners of each face.
    libraries, materials  what the lines mtllib and usemtl name, each name once.
    """

    vertices: Floats
    others: NDArray[np.float32]
    uv: Floats
    corners: Numbers
    uvs: Numbers
    sizes: Numbers
    libraries: tuple[bytes, ...]
    materials: tuple[bytes, ...]


def parse_obj(path: Path, data: bytes) -> ObjText:
    """Parse an OBJ file. Raises BadInput that names the line."""
    if b"\\" in data:  # a backslash at the end of a line continues it
        data = data.replace(b"\\\r\n", b"  \n").replace(b"\\\n", b"  ")
    text = np.frombuffer(data + b"\n", np.uint8)
    parts = _parts(text)
    counted = in_threads(lambda part: _count(text[part]), parts)
    counts = np.array([sizes for sizes, _, _ in counted])
    before, sizes = np.cumsum(counts, axis=0) - counts, counts.sum(axis=0)
    if sizes[VERTEX] * MIN_VERTEX_BYTES > len(text):
        raise BadInput(f"{path}: a vertex has fewer than three coordinates", DAMAGED)
    check_counts(path, sizes[VERTEX], max(sizes[-1] - 2 * sizes[FACE], 0))
    vertices, others = np.empty((sizes[VERTEX], 3)), np.empty((sizes[VERTEX], VALUES - 3), np.float32)
    uv, faces = np.empty((sizes[TEXCOORD], 2)), np.zeros(sizes[FACE], np.int32)
    corners, uvs = np.empty(sizes[-1], np.int32), np.empty(sizes[-1], np.int32)

    def fill(part: slice, start: Ints) -> tuple[Numbers, Bytes]:
        """Fill the arrays from a part of the text.

        Returns places and words left for `_parse_remaining`.
        """
        places, words = np.empty(0, np.int32), np.empty(0, np.uint8)
        while True:  # most files have no number that the kernel cannot parse exactly; for others, room is made
            found = _fill(text[part], start, vertices, others, uv, faces, corners, uvs, places, words)
            fault, line, count, length = (int(number) for number in found)
            if fault:
                raise _line_error(path, data, fault, data.count(b"\n", 0, part.start) + line)
            if count == len(places):
                return places, words
            places, words = np.empty(count, np.int32), np.empty(length, np.uint8)

    left = in_threads(lambda item: fill(*item), zip(parts, before, strict=True))
    for places, words in left:
        _parse_remaining(path, places, words, vertices, others, uv)
    offsets = [[part.start + one for one in found[1:]] for part, found in zip(parts, counted, strict=True)]
    names = (_names(path, data, np.concatenate(places)) for places in zip(*offsets, strict=True))
    return ObjText(vertices, others, uv, corners, uvs, faces, *names)


def _parts(text: Bytes) -> list[slice]:
    """Return parts of whole lines of a text for threads, at least PART_BYTES but the last."""
    size, edges = max(len(text) // PARTS, PART_BYTES), [0]
    while edges[-1] < len(text):
        end = edges[-1] + size
        edges.append(_line_end(text, end) + 1 if end < len(text) else len(text))
    return [slice(a, b) for a, b in pairwise(edges)]


def _names(path: Path, data: bytes, places: Ints) -> tuple[bytes, ...]:
    """The texts between the offsets (k, 2), each once."""
    names = dict[bytes, None]()
    for start, end in places:
        names[data[start:end].strip()] = None
        if len(names) > MAX_NAMES:
            raise BadInput(f"{path} names more than {MAX_NAMES} materials", ONE_SHOT)
    return tuple(names)


def _parse_remaining(
    path: Path, places: Numbers, words: Bytes, vertices: Floats, others: NDArray[np.float32], uv: Floats
) -> None:
    """Parse the numbers of many digits, whose words have blanks between them.

    A place is 7 · vertex + column of position and colour, or −1 − (2 · texture coordinate + column).
    """
    parsed = parse_numbers(words.tobytes(), path, "a line")
    if len(parsed) != len(places):
        raise BadInput(f"{path}: a word stands where a number should be", DAMAGED)
    row, column = np.divmod(places, VALUES)
    for array, here, first in ((vertices, column < 3, 0), (others, column >= 3, 3)):
        here = here & (places >= 0)
        array[row[here], column[here] - first] = parsed[here]
    uv.reshape(-1)[-1 - places[places < 0]] = parsed[places < 0]


def _line_error(path: Path, data: bytes, fault: int, line: int) -> BadInput:
    """Return the error for a fault on a line.

    A fault on an unterminated last line is reported as a truncated file.
    """
    if line == data.count(b"\n") + 1 and not data.endswith(b"\n"):
        return BadInput(f"{path} seems cut short: line {line} is not complete", CUT_SHORT)
    reasons = {
        NUMBER_FAULT: "a word stands where a number should be",
        CORNER_FAULT: "a corner of the face is not of the form 1, 1/2, 1//3 or 1/2/3",
        INDEX_FAULT: "an index of the face is out of bounds",
        COUNT_FAULT: f"the face has more than {MAX_CORNERS} corners",
    }
    return BadInput(f"{path}, line {line}: {reasons[fault]}", DAMAGED)


@numba.njit(cache=True)
def _is_blank(byte: int) -> bool:
    return byte in (BLANK, TAB, RETURN)


@numba.njit(cache=True)
def _keyword(text: Bytes, at: int) -> tuple[int, int]:
    """Return the kind of a line and the end of its first word.

    The word begins at `at`; the kind is −1 for others.
    """
    end = at
    while not _is_blank(text[end]) and text[end] != NEWLINE:
        end += 1
    length, first = end - at, text[at]
    if length == 1 and first == 118:  # v
        return VERTEX, end
    if length == 2 and first == 118 and text[at + 1] == 116:  # vt
        return TEXCOORD, end
    if length == 1 and first == 102:  # f
        return FACE, end
    if length == 6 and first == 109 and text[at + 1] == 116 and text[at + 2] == 108 and text[at + 3] == 108:
        return LIBRARY, end  # mtllib
    if length == 6 and first == 117 and text[at + 1] == 115 and text[at + 2] == 101 and text[at + 3] == 109:
        return MATERIAL, end  # usemtl
    return -1, end


@numba.njit(cache=True)
def _next_word(text: Bytes, at: int) -> tuple[int, int]:
    """Start and end of the next word of a line; equal at its end or at a comment."""
    while _is_blank(text[at]):
        at += 1
    end = at
    if text[at] == HASH:
        return at, at
    while not _is_blank(text[end]) and text[end] != NEWLINE:
        end += 1
    return at, end


@numba.njit(cache=True)
def _line_end(text: Bytes, at: int) -> int:
    while text[at] != NEWLINE:
        at += 1
    return at


@numba.njit(cache=True, nogil=True)
def _count(text: Bytes) -> tuple[Ints, Ints, Ints]:
    """Count the lines of each kind and the corners in all, (6,).

    Returns also the offsets (k, 2) of the names of mtllib and usemtl lines.
    """
    counts, at = np.zeros(6, np.int64), 0
    while at < len(text):
        start, _ = _next_word(text, at)
        kind, word = _keyword(text, start)
        if kind >= 0:
            counts[kind] += 1
        if kind == FACE:
            begin, word = _next_word(text, word)
            while word > begin:
                counts[5] += 1
                begin, word = _next_word(text, word)
        at = _line_end(text, word) + 1
    names = np.empty((counts[LIBRARY] + counts[MATERIAL], 2), np.int64)
    libraries, materials, at = 0, counts[LIBRARY], 0
    while len(names) and at < len(text):
        start, _ = _next_word(text, at)
        kind, word = _keyword(text, start)
        at = _line_end(text, word) + 1
        if kind == LIBRARY:
            names[libraries] = word, at - 1
            libraries += 1
        elif kind == MATERIAL:
            names[materials] = word, at - 1
            materials += 1
    return counts, names[: counts[LIBRARY]], names[counts[LIBRARY] :]


@numba.njit(cache=True, nogil=True)
def _fill(
    text: Bytes,
    start: Ints,
    vertices: Floats,
    others: NDArray[np.float32],
    uv: Floats,
    faces: Numbers,
    corners: Numbers,
    uvs: Numbers,
    places: Numbers,
    words: Bytes,
) -> tuple[int, int, int, int]:
    """Fill the arrays from a part of the file.

    start: (6,), lines of each kind and corners before the part.
    Returns a fault or 0, its line, number and length of the words left for `_parse_remaining`.
    """
    at, line, left, length = 0, 0, 0, 0
    vertex, texcoord, face, corner = start[VERTEX], start[TEXCOORD], start[FACE], start[5]
    while at < len(text):
        line += 1
        begin, _ = _next_word(text, at)
        kind, word = _keyword(text, begin)
        if kind in (VERTEX, TEXCOORD):
            width = VALUES if kind == VERTEX else 2
            begin, word = _next_word(text, word)
            count = 0
            while word > begin:
                if count < width:
                    state, value = _number(text, begin, word)
                    if state == 0:
                        return NUMBER_FAULT, line, left, length
                    if state == 2:
                        if left < len(places):
                            places[left] = vertex * VALUES + count if kind == VERTEX else -1 - (texcoord * 2 + count)
                            words[length : length + word - begin] = text[begin:word]
                            words[length + word - begin] = BLANK
                        left, length = left + 1, length + word - begin + 1
                    elif kind == TEXCOORD:
                        uv[texcoord, count] = value
                    elif count < 3:
                        vertices[vertex, count] = value
                    else:
                        others[vertex, count - 3] = value
                count += 1
                begin, word = _next_word(text, word)
            if count < (3 if kind == VERTEX else 1):
                return NUMBER_FAULT, line, left, length
            if kind == VERTEX:
                for k in range(max(count - 3, 0), VALUES - 3):
                    others[vertex, k] = np.nan
                vertex += 1
            else:
                if count == 1:
                    uv[texcoord, 1] = 0.0
                texcoord += 1
        elif kind == FACE:
            faces[face] = 0
            begin, word = _next_word(text, word)
            while word > begin:
                state, a, b = _corner(text, begin, word, vertex, texcoord)
                if state:
                    return state, line, left, length
                if a >= len(vertices) or b >= len(uv):
                    return INDEX_FAULT, line, left, length
                corners[corner], uvs[corner] = a, b
                corner += 1
                faces[face] += 1
                if faces[face] > MAX_CORNERS:
                    return COUNT_FAULT, line, left, length
                begin, word = _next_word(text, word)
            face += 1
        at = _line_end(text, word) + 1
    return 0, 0, left, length


@numba.njit(cache=True)
def _number(text: Bytes, at: int, end: int) -> tuple[int, float]:
    """Parse a number, where that is simple.

    Returns 0 for text that cannot be a number; 1 and the exact value; 2 for one that `_parse_remaining` has to parse.
    """
    first = text[at]
    if not (ZERO <= first <= NINE or first in (MINUS, PLUS, POINT)):
        return (2 if first in (73, 78, 105, 110) else 0), 0.0  # inf and nan are numbers, whose place is refused later
    negative = first == MINUS
    if negative or first == PLUS:
        at += 1
    mantissa, power, digits, point = np.int64(0), 0, 0, False
    while at < end and (ZERO <= text[at] <= NINE or (text[at] == POINT and not point)):
        if text[at] == POINT:
            point = True
        else:
            if mantissa >= EXACT_DIGITS // 10:
                return 2, 0.0
            mantissa = mantissa * 10 + np.int64(text[at] - ZERO)
            digits += 1
            power -= point
        at += 1
    if at < end and digits and (text[at] == LOWER_E or text[at] == UPPER_E):
        return 2, 0.0
    if at < end or not digits or power < -EXACT_POWER:
        return 2, 0.0
    value = np.float64(mantissa) / POWERS[-power]
    return 1, -value if negative else value


@numba.njit(cache=True)
def _corner(text: Bytes, at: int, end: int, vertices: int, texcoords: int) -> tuple[int, int, int]:
    """A fault or 0, the vertex and the texture coordinate of a corner, −1 for none."""
    state, vertex, at = _index(text, at, end, vertices)
    if state:
        return state, 0, 0
    texcoord = -1
    if at < end:
        at += 1  # behind a slash
        if at < end and text[at] != SLASH:
            state, texcoord, at = _index(text, at, end, texcoords)
            if state:
                return state, 0, 0
        if at < end:  # the normal is not needed
            at += 1
            if at < end:
                if text[at] == MINUS:
                    at += 1
                while at < end and ZERO <= text[at] <= NINE:
                    at += 1
            if at < end:
                return CORNER_FAULT, 0, 0
    return 0, vertex, texcoord


@numba.njit(cache=True)
def _index(text: Bytes, at: int, end: int, count: int) -> tuple[int, int, int]:
    """Parse an index; negative ones count back from the latest of `count`.

    Returns a fault or 0, the index from 0 on, and where it ends.
    """
    negative = text[at] == MINUS
    at += negative
    value, digits = np.int64(0), 0
    while at < end and ZERO <= text[at] <= NINE:
        if value > 2**40:
            return INDEX_FAULT, 0, at
        value = value * 10 + np.int64(text[at] - ZERO)
        digits += 1
        at += 1
    if not digits or (at < end and text[at] != SLASH):
        return CORNER_FAULT, 0, at
    value = count - value if negative else value - 1
    if value < 0:
        return INDEX_FAULT, 0, at
    return 0, int(value), at
