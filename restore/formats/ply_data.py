"""Parser of Stanford polygon files, text and binary.

Time and memory are linear in the size of the file.

G. Turk, "The PLY Polygon File Format", 1994. A file is a header that lists elements with their properties, and the
records of each element one after the other. A property is a number or a list that begins with its length.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput
from restore.formats.parsing.mesh import MAX_ITEMS, Numbers
from restore.formats.parsing.records import find_lists, gather
from restore.formats.parsing.source import CUT_SHORT, DAMAGED, ONE_SHOT, parse_numbers, without_mark

MAX_HEADER_BYTES = 2**16  # a header is a page of text
MAX_PROPERTIES = 64  # of an element; a vertex with position, normal, colour and texture coordinates has a dozen
ENCODINGS = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}
TYPES = {
    b"char": "i1", b"uchar": "u1", b"short": "i2", b"ushort": "u2", b"int": "i4", b"uint": "u4", b"float": "f4",
    b"double": "f8", b"int8": "i1", b"uint8": "u1", b"int16": "i2", b"uint16": "u2", b"int32": "i4", b"uint32": "u4",
    b"float32": "f4", b"float64": "f8",
}  # fmt: skip
TEXT_TYPE = "<f8"  # every number of a text file, once it is parsed; whole numbers below 2^53 are exact
REMARKS = ([b"comment"], [b"obj_info"])  # some writers put them before the format
_END = re.compile(rb"\nend_header[ \t]*\r?\n")


@dataclass(frozen=True)
class Property:
    """Property of an element: NumPy type of its numbers, and of the length of a list."""

    name: str
    kind: str
    length_kind: str | None = None


@dataclass(frozen=True)
class Element:
    """Element of the header: number of records, and properties in the order of the file."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)


@dataclass(frozen=True)
class Header:
    """Header of a file.

    The NumPy byte order (empty for text), the elements, the comments, the obj_info lines.
    """

    order: str
    elements: tuple[Element, ...]
    comments: tuple[bytes, ...]
    notes: tuple[bytes, ...]


@dataclass(frozen=True, eq=False)
class Lists:
    """A list of every record: all numbers (c,), starts of the lists (n,), lengths (n,)."""

    values: NDArray[Any]
    starts: Numbers
    sizes: Numbers


@dataclass(frozen=True, eq=False)
class PlyData:
    """Contents of a file.

    columns  by element and property, (n,) numbers; views of the file where it is binary, and has no lists there.
    lists    by element and property.
    """

    header: Header
    columns: dict[str, dict[str, NDArray[Any]]]
    lists: dict[str, dict[str, Lists]]


def parse_ply(path: Path, data: bytes) -> PlyData:
    """Parse a file.

    Raises BadInput, also when it is shorter or longer than its header promises.
    """
    data = without_mark(data)
    header, body = _parse_header(path, data)
    promised = sum(element.count for element in header.elements)
    if header.order:
        content = np.frombuffer(data, np.uint8, offset=body)
        elements = header.elements
    else:
        content = parse_numbers(data[body:], path, "the body").view(np.uint8)
        content.flags.writeable = False  # as the bytes of a file: the kernels are compiled once for both
        elements = tuple(_as_text(element) for element in header.elements)
    columns, lists, at = {}, {}, 0
    for element in elements:
        columns[element.name], lists[element.name], at = _element(path, content, at, element, promised)
    if content[at:].tobytes().strip():  # some writers end a binary file with a line end
        raise BadInput(f"{path} holds more than the {promised} vertices and faces that it promises", DAMAGED)
    return PlyData(header, columns, lists)


def _parse_header(path: Path, data: bytes) -> tuple[Header, int]:
    end = _END.search(data, 0, MAX_HEADER_BYTES)
    lines = [line.strip() for line in data[: end.start() if end else 0].split(b"\n")]
    first = next((k for k, line in enumerate(lines) if k and line.split()[:1] not in REMARKS), 0)
    words = lines.pop(first).split() if first else []
    if end is None or lines[0] != b"ply" or words[:1] != [b"format"] or words[1:2] == [] or words[1] not in ENCODINGS:
        raise BadInput(f"{path} has no PLY header", DAMAGED)
    order, elements, comments, notes = ENCODINGS[words[1]], list[Element](), list[bytes](), list[bytes]()
    for line in lines[1:]:
        keyword, _, rest = line.partition(b" ")
        if keyword == b"element":
            elements.append(_declared_element(path, rest.split()))
        elif keyword == b"property":
            _add_property(path, elements, rest.split(), order)
        elif keyword == b"comment":
            comments.append(rest.strip())
        elif keyword == b"obj_info":
            notes.append(rest.strip())
        elif line:
            raise BadInput(f"{path}: its header has a line {line[:40]!r}, which cannot be", DAMAGED)
    if len({element.name for element in elements}) < len(elements):
        raise BadInput(f"{path}: its header has an element twice", DAMAGED)
    return Header(order, tuple(elements), tuple(comments), tuple(notes)), end.end()


def _declared_element(path: Path, words: list[bytes]) -> Element:
    if len(words) != 2 or not words[1].isdigit() or len(words[1]) > 18:
        raise BadInput(f"{path}: its header has an element without a name or a count", DAMAGED)
    return Element(words[0].decode("ascii", "replace"), int(words[1]))


def _add_property(path: Path, elements: list[Element], words: list[bytes], order: str) -> None:
    kinds = [TYPES.get(word) for word in (words[1:3] if words[:1] == [b"list"] else words[:1])]
    whole = len(words) == (4 if words[:1] == [b"list"] else 2) and all(kinds)
    if not elements or not whole or len(elements[-1].properties) >= MAX_PROPERTIES:
        raise BadInput(f"{path}: its header has a property {b' '.join(words)[:40]!r}, which cannot be", DAMAGED)
    *length, kind = (f"{order or '<'}{kind}" for kind in kinds)
    if length and length[0][1] == "f":
        raise BadInput(f"{path}: the length of a list is not a whole number", DAMAGED)
    name = words[-1].decode("ascii", "replace")
    elements[-1].properties.append(Property(name, kind, length[0] if length else None))


def _as_text(element: Element) -> Element:
    """The element as it is in the parsed numbers of a text file."""
    properties = [Property(p.name, TEXT_TYPE, TEXT_TYPE if p.length_kind else None) for p in element.properties]
    return Element(element.name, element.count, properties)


def _element(
    path: Path, content: NDArray[np.uint8], at: int, element: Element, promised: int
) -> tuple[dict[str, NDArray[Any]], dict[str, Lists], int]:
    """Return the columns, or the lists, of an element, and its end.

    The element begins at the offset `at`.
    """
    least = sum(np.dtype(p.length_kind or p.kind).itemsize for p in element.properties)
    if element.count * least > len(content) - at:
        raise _cut(path, promised)
    if element.count > MAX_ITEMS:
        raise BadInput(f"{path} has {element.count} records of {element.name}, more than {MAX_ITEMS}", ONE_SHOT)
    names = [p.name for p in element.properties]
    if len(set(names)) < len(names):
        raise BadInput(f"{path}: a property of {element.name} is there twice", DAMAGED)
    if not any(p.length_kind for p in element.properties):
        record = np.dtype([(p.name, p.kind) for p in element.properties])
        table = np.frombuffer(content, record, element.count, at) if least else np.empty(0, record)
        return {name: table[name] for name in names}, {}, at + element.count * least
    return _lists(path, content, at, element, promised)


def _lists(
    path: Path, content: NDArray[np.uint8], at: int, element: Element, promised: int
) -> tuple[dict[str, NDArray[Any]], dict[str, Lists], int]:
    """The numbers and the lists of an element that has lists, and where it ends."""
    sizes = np.array([np.dtype(p.kind).itemsize for p in element.properties])
    length_kinds = [p.length_kind for p in element.properties]
    lengths = np.array([0 if kind is None else np.dtype(kind).itemsize for kind in length_kinds])
    big = any(kind is not None and kind[0] == ">" for kind in length_kinds)
    starts = np.empty((np.count_nonzero(lengths), element.count), np.int32)  # a file has less than 2^31 bytes
    counts = np.empty_like(starts)
    end = find_lists(content, at, lengths, sizes, big, starts, counts)
    if end < 0:
        raise _cut(path, promised)
    found, listed = {}, [p for p in element.properties if p.length_kind]
    for begins, lasts, p in zip(starts, counts, listed, strict=True):
        width = np.dtype(p.kind).itemsize
        values = np.empty(int(lasts.sum(dtype=np.int64)) * width, np.uint8)
        gather(content, begins, lasts, width, values)
        found[p.name] = Lists(values.view(p.kind), np.cumsum(lasts, dtype=np.int32) - lasts, lasts)
    return _between_lists(content, element, starts, counts), found, end


def _between_lists(
    content: NDArray[np.uint8], element: Element, starts: Numbers, counts: Numbers
) -> dict[str, NDArray[Any]]:
    """Return the numbers (n,) of an element outside its lists.

    They stand before, between and behind the lists, which begin at starts (l, n).
    """
    sizes = [np.dtype(p.kind).itemsize for p in element.properties]
    first = next(k for k, p in enumerate(element.properties) if p.length_kind)
    before = sum(sizes[:first]) + np.dtype(element.properties[first].length_kind).itemsize
    at, lists, found = starts[0].astype(np.int64) - before, 0, {}
    for p, size in zip(element.properties, sizes, strict=True):
        if p.length_kind:
            at = starts[lists].astype(np.int64) + counts[lists].astype(np.int64) * size
            lists += 1
            continue
        found[p.name] = content[at[:, None] + np.arange(size)].reshape(-1).view(p.kind)
        at = at + size
    return found


def _cut(path: Path, promised: int) -> BadInput:
    return BadInput(f"{path} seems cut short: it promises {promised} vertices and faces and ends before", CUT_SHORT)
