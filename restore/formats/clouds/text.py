"""Text with one point in each line: `.xyz`, `.asc`, `.pts`, `.txt`, `.csv`.

Columns are named by a first line (CloudCompare's begins with //), or follow from their values: three columns of unit
vectors are normals, whole numbers up to 255 in the last three columns colours, the first three of the rest x, y and z,
one more an intensity. Separators are blanks, tabs, commas or semicolons; numbers may have decimal commas. The first
line may count the points, as in Leica's PTS (paulbourke.net/dataformats/pts).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from restore.errors import BadInput
from restore.formats.clouds.cloud import MAX_BYTES, SUBSET, Cloud, Size, cloud_of
from restore.formats.clouds.gocator import gocator_cloud, is_gocator
from restore.formats.clouds.grid_size import sized
from restore.formats.parsing.source import DAMAGED, parse_numbers, read_bytes, with_newlines, without_mark
from restore.formats.ply_data import MAX_HEADER_BYTES
from restore.scan import Bytes, Floats

COLUMNS = "write one point in each line: x y z, or x y z r g b"
NAMES = {
    "x": "x", "y": "y", "z": "z", "r": "r", "g": "g", "b": "b", "red": "r", "green": "g", "blue": "b", "nx": "nx",
    "ny": "ny", "nz": "nz", "normalx": "nx", "normaly": "ny", "normalz": "nz", "i": "i", "intensity": "i",
    "reflectance": "i", "scalarfield": "i", "rf": "r", "gf": "g", "bf": "b", "px": "x", "py": "y", "pz": "z",
    "xcoordinate": "x", "ycoordinate": "y", "zcoordinate": "z",
}  # fmt: skip
BYTE = 255.0
UNIT = 1e-2  # of the length of a normal: rounding to two decimals
_BLANK = re.compile(rb"[ \t]")
_COMMENT = re.compile(rb"(?m)^[ \t]*(?:#|//|%)[^\n]*\n?")
_DECIMAL_COMMA = re.compile(rb"\d,\d")


@dataclass(frozen=True)
class Layout:
    """The separator of a text (empty for blanks), its decimal mark, and its names."""

    separator: bytes
    comma: bool
    names: tuple[str, ...]
    body: int


def read_text(path: Path, size: Size | None = None) -> Cloud:
    """Read a cloud of text. size: of its grid, where it was given. Raises BadInput."""
    text = with_newlines(without_mark(read_bytes(path, MAX_BYTES)))
    if b"\0" in text[:MAX_HEADER_BYTES]:
        raise BadInput(f"{path} is not text", DAMAGED)
    if is_gocator(text):
        return gocator_cloud(path, text)
    layout = _layout(path, text)
    values = _values(path, text[layout.body :], layout)
    names = _named(layout.names, values.shape[1]) or _by_values(values)
    if not all(name in names for name in "xyz"):
        raise BadInput(f"{path}: its {values.shape[1]} columns have no x, y and z", COLUMNS)
    points, colours, normals = (_some(values, names, some) for some in ("x y z", "r g b", "nx ny nz"))
    intensity = None if "i" not in names else values[:, names.index("i")]
    assert points is not None
    found = None if colours is None else _bytes(colours)
    return sized(path, cloud_of(path, points, found, intensity, normals=normals), size)


def _layout(path: Path, text: bytes) -> Layout:
    """Return the layout that the first lines of a text have."""
    head, at, names = text[:MAX_HEADER_BYTES], 0, tuple[str, ...]()
    for line in head.splitlines(keepends=True):
        words = re.split(rb"[\s,;]+", line.strip().lstrip(b"#/%").strip())
        marked = line.lstrip()[:1] in b"#/%" and line.strip() != b""
        if any(re.search(rb"[a-zA-Z]", word) and word.lower() not in (b"nan", b"inf", b"-nan") for word in words):
            mark = next((mark for mark in (b";", b",") if mark in line), None)
            found = tuple(_name(word) for word in (words if mark is None else line.split(mark)))
            names = found if {"x", "y", "z"} <= set(found) and found.count("?") < len(found) / 2 else names
        elif not marked and line.strip() and not (len(words) == 1 and words[0].isdigit()):
            break
        at += len(line)
    body = head[at:].rpartition(b"\n")[0] or head[at:]
    if not body.strip():
        raise BadInput(f"{path} holds no points", COLUMNS)
    if b";" in body:
        return Layout(b";", bool(_DECIMAL_COMMA.search(body)), names, at)
    first = body.strip().splitlines()[0]
    blanks = len(re.findall(rb"[^,\s][ \t]+[^,\s]", first))
    if b"," in body and not blanks:
        return Layout(b",", False, names, at)
    return Layout(b"", bool(_DECIMAL_COMMA.search(body)), names, at)


def _name(word: bytes) -> str:
    return NAMES.get(re.sub(r"\[.*|\(.*|[^a-z]", "", word.decode("utf-8", "replace").lower()), "?")


def _values(path: Path, text: bytes, layout: Layout) -> Floats:
    """Return the numbers (n, columns) of a text."""
    if _COMMENT.search(text):
        text = _COMMENT.sub(b"", text)
    if layout.separator:
        text = _BLANK.sub(b"", text) if _BLANK.search(text) else text
        mark = layout.separator
        while mark + mark in text:  # a missing value
            text = text.replace(mark + mark, mark + b"nan" + mark)
        text = text.replace(b"\n" + mark, b"\nnan" + mark).replace(mark + b"\n", mark + b"nan\n")
        text = text.replace(b",", b".") if layout.comma else text
        text = text.replace(mark, b" ")
    elif layout.comma:
        text = text.replace(b",", b".")
    columns = len(text.lstrip().partition(b"\n")[0].split())
    values = parse_numbers(text.replace(b'"', b""), path, "its text")
    if columns < 3 or len(values) % columns:
        raise BadInput(f"{path}: its lines have not {columns} numbers each", COLUMNS)
    return values.reshape(-1, columns)


def _named(names: tuple[str, ...], columns: int) -> Sequence[str]:
    return names if len(names) == columns else ()


def _by_values(values: Floats) -> Sequence[str]:
    """Return the names of columns by their values."""
    some = values[:: max(len(values) // SUBSET, 1)]
    some = some[np.isfinite(some).all(axis=1)]
    columns = some.shape[1]
    names = ["?"] * columns
    if len(some) == 0:
        return ["x", "y", "z", *names[3:]]
    if columns > 3 and (np.diff(some[:, 0]) == some[1, 0] - some[0, 0] if len(some) > 1 else np.zeros(1)).all():
        names[0] = "number"
    whole = np.asarray(((some == np.rint(some)) & (some >= 0) & (some <= BYTE)).all(axis=0))
    _name_three(names, ("nx", "ny", "nz"), [k for k in range(columns - 2) if _are_normals(some[:, k : k + 3])])
    if columns >= 6:
        colours = [k for k in range(columns - 2) if whole[k : k + 3].all() and np.ptp(some[:, k : k + 3])]
        _name_three(names, ("r", "g", "b"), colours[::-1])
    _name_three(names, ("x", "y", "z"), range(columns - 2))
    if "r" not in names and "x" in names:
        fractions = np.asarray(((some >= 0) & (some <= 1)).all(axis=0))
        _name_three(names, ("r", "g", "b"), [k for k in range(columns - 2) if fractions[k : k + 3].all()])
    if names.count("?"):
        names[names.index("?")] = "i"
    return names


def _name_three(names: list[str], three: tuple[str, str, str], places: Sequence[int]) -> None:
    """Name the first three columns of some places that have no names yet."""
    at = next((k for k in places if names[k : k + 3] == ["?"] * 3), None)
    if at is not None:
        names[at : at + 3] = three


def _are_normals(values: Floats) -> bool:
    return bool((np.abs(np.linalg.norm(values, axis=1) - 1.0) < UNIT).mean() > 1.0 - UNIT)


def _some(values: Floats, names: Sequence[str], wanted: str) -> Floats | None:
    if not all(name in names for name in wanted.split()):
        return None
    return values[:, [names.index(name) for name in wanted.split()]]


def _bytes(colours: Floats) -> Bytes | Floats:
    """Return colours (n, 3) as bytes where they are whole numbers, so that 1 is not white."""
    whole = np.nanmax(colours, initial=0.0) > 1.0 and np.nanmax(colours, initial=0.0) <= BYTE
    return np.nan_to_num(colours).clip(0, BYTE).astype(np.uint8) if whole else colours
