"""`.ptx`: text of Leica, Faro, Artec and others, in metres.

paulbourke.net/dataformats/ptx: for each scan columns, rows, the scanner's position and three axes, a matrix of four
rows that transforms rows of coordinates, then x y z intensity [r g b], column by column from the bottom up. A point at
the origin is missing. Coordinates are right-handed, and in the scanner's own frame before the matrix is applied.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from restore.errors import BadInput
from restore.formats.clouds.cloud import MAX_BYTES, Cloud, Size, check_count, cloud_of
from restore.formats.parsing.source import CUT_SHORT, DAMAGED, parse_numbers, read_bytes, with_newlines, without_mark
from restore.range_image.organise import MIN_LINES
from restore.scan import Floats

HEAD = 30  # numbers before the points of a scan
HEAD_LINES = 10


def read_ptx(path: Path, size: Size | None = None) -> Cloud:  # noqa: ARG001 - it is stated
    """Read the cloud of one scan on its grid, or of several together. Raises BadInput."""
    text = with_newlines(without_mark(read_bytes(path, MAX_BYTES)))
    first = text.split(b"\n", HEAD_LINES + 1)[HEAD_LINES : HEAD_LINES + 1]
    width = len(first[0].split()) if first else 0
    values = parse_numbers(text, path, "its text")
    if width not in (3, 4, 7) or len(values) < HEAD:
        raise BadInput(f"{path}: its first point has {width} numbers", DAMAGED)
    scans = list[tuple[Size, Floats, Floats]]()
    at = 0
    while at + HEAD <= len(values):
        cols, rows = values[at : at + 2]
        if not (cols == int(cols) and rows == int(rows)) or min(cols, rows) < 1:
            raise BadInput(f"{path}: a grid of {cols:g} × {rows:g} points cannot be", DAMAGED)
        count = int(cols) * int(rows)
        check_count(path, count + sum(len(table) for _, table, _ in scans))
        if at + HEAD + count * width > len(values):
            raise BadInput(f"{path} seems cut short: it promises {count} points and ends before", CUT_SHORT)
        matrix, at = values[at + 14 : at + HEAD].reshape(4, 4), at + HEAD
        scans.append(((int(cols), int(rows)), values[at : at + count * width].reshape(count, width), matrix))
        at += count * width
    if at < len(values):
        raise BadInput(f"{path} holds more numbers than the points that it promises", DAMAGED)
    return _one(path, *scans[0][:2]) if len(scans) == 1 else _together(path, scans)


def _one(path: Path, size: Size, table: Floats) -> Cloud:
    cols, rows = size
    grid = table.reshape(cols, rows, -1).transpose(1, 0, 2)[::-1].reshape(table.shape)
    stated = size if min(size) >= MIN_LINES else None
    return cloud_of(path, grid[:, :3], _colours(grid), _intensity(grid), size=stated, frame="right-handed")


def _together(path: Path, scans: list[tuple[Size, Floats, Floats]]) -> Cloud:
    table = np.concatenate([table for _, table, _ in scans])
    points = [
        np.where(part[:, :3].any(axis=1, keepdims=True), part[:, :3] @ matrix[:3, :3] + matrix[3, :3], np.nan)
        for _, part, matrix in scans
    ]
    return cloud_of(path, np.concatenate(points), _colours(table), _intensity(table), viewpoint=scans[0][2][3, :3])


def _colours(table: Floats) -> Floats | None:
    return table[:, 4:7] if table.shape[1] == 7 else None


def _intensity(table: Floats) -> Floats | None:
    return table[:, 3] if table.shape[1] >= 4 else None
