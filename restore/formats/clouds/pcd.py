"""`.pcd`: Point Cloud Data of the Point Cloud Library.

pointclouds.org, "The PCD (Point Cloud Data) file format", version 0.7. A header of text names fields, their bytes,
types and counts, columns and rows of an organised cloud (WIDTH, HEIGHT > 1) and the viewpoint: a translation and a
quaternion w x y z. DATA is `ascii`, a point in each line; `binary`, the records; or `binary_compressed`: the uint32
sizes of the compressed and the plain data, then one field after the other, compressed by LZF. A missing coordinate is
NaN; `rgb` and `rgba` are bytes blue, green, red, alpha of a uint32 or a float.

LZF (M. Lehmann, liblzf): a control byte below 32 is followed by that many bytes and one more, as they are. Any other
has the length in its upper three bits, 2 less than it is, with 7 continued in the next byte; its lower five bits and
the byte that follows are the distance back, 1 less than it is.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput
from restore.formats.clouds.cloud import MAX_BYTES, MAX_RATIO, Cloud, Size, check_count, cloud_of
from restore.formats.clouds.grid_size import sized
from restore.formats.parsing.source import CUT_SHORT, DAMAGED, parse_numbers, read_bytes
from restore.formats.ply_data import MAX_HEADER_BYTES, MAX_PROPERTIES
from restore.range_image.organise import MIN_LINES
from restore.scan import Bytes, Floats

KINDS = {"I": "i", "U": "u", "F": "f"}
TYPES = {"i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f4", "f8"}
COLOURS = ("rgb", "rgba")
NORMALS = ("normal_x", "normal_y", "normal_z")


@dataclass(frozen=True)
class Header:
    """Header of a file: names, NumPy types and counts of its fields, and where the data begin."""

    record: np.dtype[Any]
    size: Size
    viewpoint: tuple[float, ...]
    encoding: str
    body: int


def read_pcd(path: Path, size: Size | None = None) -> Cloud:
    """Read a cloud. size: of its grid, where it was given. Raises BadInput."""
    data = read_bytes(path, MAX_BYTES)
    header = _header(path, data)
    count = header.size[0] * header.size[1]
    check_count(path, count)
    columns = _columns(path, data, header, count)
    if not all(name in columns for name in "xyz"):
        raise BadInput(f"{path} has no fields x, y and z", DAMAGED)
    points = np.column_stack([columns[name] for name in "xyz"])
    normals = np.column_stack([columns[n] for n in NORMALS]) if all(n in columns for n in NORMALS) else None
    cloud = cloud_of(path, points, _colours(columns), columns.get("intensity"), normals=normals)
    if any(header.viewpoint):
        cloud = replace(cloud, viewpoint=np.array(header.viewpoint[:3]), axes=_rotation(header.viewpoint[3:]).T)
    return sized(path, cloud, size, header.size if min(header.size) >= MIN_LINES else None)


def _header(path: Path, data: bytes) -> Header:
    table: dict[str, list[str]] = {}
    at = 0
    while "DATA" not in table:
        end = data.find(b"\n", at, MAX_HEADER_BYTES)
        if end < 0:
            raise BadInput(f"{path} has no PCD header", DAMAGED)
        words = data[at:end].decode("ascii", "replace").split()
        at = end + 1
        if words and not words[0].startswith("#"):
            table[words[0]] = words[1:]
    try:
        names, kinds, sizes = table["FIELDS"], table["TYPE"], table["SIZE"]
        counts = [int(word) for word in table.get("COUNT", ["1"] * len(names))]
        cols, rows = int(table["WIDTH"][0]), int(table["HEIGHT"][0])
        types = [f"<{KINDS[kind]}{int(width)}" for kind, width in zip(kinds, sizes, strict=True)]
        viewpoint = tuple(float(word) for word in table.get("VIEWPOINT", []))
        encoding = table["DATA"][0]
        fields = [
            (f"{name} {k}" if name in (*names[:k], "_") else name, kind, (number,) if number != 1 else ())
            for k, (name, kind, number) in enumerate(zip(names, types, counts, strict=True))
        ]
        if min(cols, rows, *counts) < 1 or max(cols, rows, *counts) >= 2**31 or len(names) > MAX_PROPERTIES:
            raise ValueError(f"{cols} columns, {rows} rows")
        if not all(kind[1:] in TYPES for kind in types):
            raise ValueError(f"types {' '.join(types)}")
        if len(viewpoint) not in (0, 7) or not np.isfinite(viewpoint).all():
            raise ValueError("the viewpoint")
        record = np.dtype(fields)
    except (KeyError, IndexError, ValueError, TypeError, OverflowError) as error:
        raise BadInput(f"{path}: its header cannot be: {error}", DAMAGED) from error
    return Header(record, (cols, rows), viewpoint, encoding, at)


def _columns(path: Path, data: bytes, header: Header, count: int) -> dict[str, NDArray[Any]]:
    """Return the fields (count,) by name; those of several numbers are left out."""
    width, body = header.record.itemsize, header.body
    if header.encoding == "ascii":
        return _of_text(path, data[body:], header.record, count)
    if header.encoding == "binary_compressed":
        plain = _plain(path, data, body, width * count)
        columns, at = {}, 0
        for name in header.record.names or ():
            kind = header.record[name]
            columns[name] = np.frombuffer(plain, kind.base, count * (kind.itemsize // kind.base.itemsize), at)
            at += kind.itemsize * count
        return {name: values for name, values in columns.items() if len(values) == count}
    if header.encoding != "binary":
        raise BadInput(f"{path} has data of the kind {header.encoding[:20]!r}", DAMAGED)
    if len(data) - body < width * count:
        raise _cut(path, count)
    table = np.frombuffer(data, header.record, count, body)
    return {name: table[name] for name in header.record.names or () if table[name].ndim == 1}


def _of_text(path: Path, text: bytes, record: np.dtype[Any], count: int) -> dict[str, NDArray[Any]]:
    names = list(record.names or ())
    numbers = [record[name].itemsize // record[name].base.itemsize for name in names]
    values = parse_numbers(text, path, "the data")
    if len(values) != count * sum(numbers):
        raise (
            _cut(path, count)
            if len(values) < count * sum(numbers)
            else BadInput(f"{path} holds more numbers than the {count} points that it promises", DAMAGED)
        )
    table = values.reshape(count, sum(numbers))
    first = dict(zip(names, np.cumsum([0, *numbers[:-1]]), strict=True))
    found = {name: table[:, first[name]] for name, number in zip(names, numbers, strict=True) if number == 1}
    for name in {*COLOURS} & {*found}:  # the number of a float's text, or of the whole number that it holds
        kind = record[name].base
        with np.errstate(invalid="ignore", over="ignore"):
            found[name] = found[name].astype(kind if kind.kind == "f" else np.int64).astype(kind)
    return found


def _colours(columns: dict[str, NDArray[Any]]) -> NDArray[Any] | None:
    """Return the colours (n, 3) of columns, packed or not."""
    packed = next((columns[name] for name in COLOURS if name in columns), None)
    if packed is not None and packed.dtype.itemsize == 4:
        blue_first: Bytes = np.ascontiguousarray(packed).view(np.uint8).reshape(-1, 4)
        return blue_first[:, 2::-1]
    names = next((n for n in (("r", "g", "b"), ("red", "green", "blue")) if all(one in columns for one in n)), None)
    return None if names is None else np.column_stack([columns[name] for name in names])


def _rotation(quaternion: tuple[float, ...]) -> Floats:
    """Return the rotation (3, 3) of a quaternion w x y z, of any length."""
    w, x, y, z = np.array(quaternion) / (np.linalg.norm(quaternion) or 1.0)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _plain(path: Path, data: bytes, body: int, size: int) -> Bytes:
    """Return the decompressed data (size,)."""
    if len(data) < body + 8:
        raise BadInput(f"{path} seems cut short: it ends before its data", CUT_SHORT)
    compressed, plain = struct.unpack_from("<II", data, body)
    content = np.frombuffer(data, np.uint8, offset=body + 8)
    if plain != size or size > MAX_RATIO * max(compressed, 1):
        raise BadInput(f"{path}: its compressed data hold {plain} bytes, its points take {size}", DAMAGED)
    if compressed > len(content):
        raise BadInput(f"{path} seems cut short: it promises {compressed} bytes and holds {len(content)}", CUT_SHORT)
    out = np.empty(size, np.uint8)
    if _expand(content[:compressed], out) != size:
        raise BadInput(f"{path}: its compressed data cannot be", DAMAGED)
    return out


@numba.njit(cache=True)
def _expand(content: Bytes, out: Bytes) -> int:
    """Write LZF data, decompressed, and return their bytes; −1 for data that cannot be."""
    at, end = 0, 0
    while at < len(content):
        control = int(content[at])
        at += 1
        if control < 32:
            count = control + 1
            if at + count > len(content) or end + count > len(out):
                return -1
            for k in range(count):
                out[end + k] = content[at + k]
            at += count
        else:
            count = (control >> 5) + 2
            if count == 9 and at < len(content):
                count += int(content[at])
                at += 1
            if at >= len(content):
                return -1
            first = end - ((control & 31) << 8) - int(content[at]) - 1
            at += 1
            if first < 0 or end + count > len(out):
                return -1
            for k in range(count):
                out[end + k] = out[first + k]
        end += count
    return end


def _cut(path: Path, count: int) -> BadInput:
    return BadInput(f"{path} seems cut short: it promises {count} points and ends before", CUT_SHORT)
