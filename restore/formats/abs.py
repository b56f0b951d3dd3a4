"""`.abs`, `.abs.gz`: the Face Recognition Grand Challenge's range image.

Three header lines (rows, columns, "pixels (flag X Y Z):"), then four images as text: flag, X, Y, Z, row by row from the
top. A sample without a measurement has flag 0 and coordinates of −999999, or 0 from some converters.
"""

from __future__ import annotations

import gzip
import re
import zlib
from pathlib import Path

import numpy as np

from restore.errors import BadInput
from restore.formats.parsing.grid import check_grid, samples_in_picture
from restore.formats.parsing.mesh import provenance
from restore.formats.parsing.picture import adjacent_picture, read_image
from restore.formats.parsing.source import CUT_SHORT, DAMAGED, is_file, parse_numbers, read_bytes
from restore.numerics.units import MAX_COORDINATE_MM
from restore.scan import Bytes, RangeScan

ABSENT = -999999.0
MAX_HEADER_BYTES = 1024  # three short lines
# A flag and three coordinates of at most 25 characters ("-1.2345678901234567e+00 "): decompression stops there.
MAX_SAMPLE_BYTES = 4 + 3 * 26
# Coordinates of six digits are packed to a half or a third, absent samples to a thousandth: the text of a 640 × 480
# scan of nothing but those has 11 MB. Only crafted files unpack to more than this together.
MAX_UNPACKED_BYTES, MAX_RATIO = 24 * 2**20, 8
_HEADER = re.compile(rb"\s*(\d{1,9})\s+row[^\n]*\n\s*(\d{1,9})\s+col[^\n]*\n\s*pixel[^\n]*\n", re.IGNORECASE)
GZIP_MAGIC = b"\x1f\x8b"


def read_abs(path: Path, texture: Bytes | None = None) -> RangeScan:
    """Read a range image with its texture.

    texture: (h, w, 3), else the picture next to the file; both show the same view.
    Raises BadInput.
    """
    data = read_bytes(path)
    rows, cols, first = _header(path, _unpack(path, data, MAX_HEADER_BYTES, whole=False))
    limit = min(first + rows * cols * MAX_SAMPLE_BYTES, MAX_UNPACKED_BYTES + MAX_RATIO * len(data))
    text = _unpack(path, data, limit)[first:]
    values = parse_numbers(text, path, "the range image")
    if values.size < 4 * rows * cols:
        raise BadInput(
            f"{path} seems cut short: it holds {values.size} numbers, {rows} × {cols} samples need {4 * rows * cols}",
            CUT_SHORT,
        )
    if values.size > 4 * rows * cols:
        raise BadInput(f"{path} holds {values.size} numbers, {rows} × {cols} samples need {4 * rows * cols}", DAMAGED)
    flag, *xyz = values.reshape(4, rows, cols)
    points = np.stack(xyz, axis=-1)
    absent = ~(flag > 0) | (points == ABSENT).any(axis=2) | (points == 0).all(axis=2) | ~np.isfinite(points).all(axis=2)
    points[absent] = np.nan
    if (np.abs(points[~absent]) > MAX_COORDINATE_MM).any():
        raise BadInput(f"{path}: a measured point lies beyond {MAX_COORDINATE_MM:g} mm", DAMAGED)
    if texture is None:
        texture = adjacent_picture(path)
    if texture is None:
        texture = _paired_picture(path)
    return RangeScan(points, texture, samples_in_picture(path, rows, cols, texture), provenance(path))


def write_abs(scan: RangeScan, path: Path) -> None:
    """Write a range image with 1 nm of resolution, compressed when the name ends in .gz.

    It carries no picture.
    """
    measured = scan.measured
    points = np.where(measured[..., None], scan.points, ABSENT)
    rows, cols = measured.shape
    lines = [f"{rows} rows", f"{cols} columns", "pixels (flag X Y Z):"]
    lines += [" ".join(map(str, measured.ravel().astype(int)))]
    lines += [" ".join(map("{:.6f}".format, points[..., axis].ravel())) for axis in range(3)]
    data = ("\n".join(lines) + "\n").encode()
    path.write_bytes(gzip.compress(data, mtime=0) if path.suffix == ".gz" else data)


def _paired_picture(path: Path) -> Bytes | None:
    """Return the picture by the challenge's own naming, if it exists.

    02463d562.abs.gz goes with 02463d563.ppm.
    """
    name = re.match(r"(.*d)(\d{1,9})\.abs", path.name)
    if name is None:
        return None
    picture = path.with_name(f"{name[1]}{int(name[2]) + 1:0{len(name[2])}d}.ppm")
    return read_image(picture) if is_file(picture) else None


def _unpack(path: Path, data: bytes, limit: int, *, whole: bool = True) -> bytes:
    """Return at most `limit` bytes of the text.

    With `whole`, raises BadInput when the text is longer or is cut off.
    """
    if not data.startswith(GZIP_MAGIC):
        return data
    stream = zlib.decompressobj(wbits=31)  # with a gzip header and its checksum
    try:
        text = stream.decompress(data, limit)
    except zlib.error as error:
        raise BadInput(f"{path} does not unpack: {error}", DAMAGED) from error
    if whole and not stream.eof:
        if stream.unconsumed_tail:
            raise BadInput(f"{path} unpacks to more than its samples can fill", DAMAGED)
        raise BadInput(f"{path} seems cut short: its archive does not end", CUT_SHORT)
    return text


def _header(path: Path, text: bytes) -> tuple[int, int, int]:
    """Return rows, columns, and offset of the numbers.

    Writers differ in blanks and in the rest of the header lines.
    """
    match = _HEADER.match(text, 0, MAX_HEADER_BYTES)
    if match is None:
        raise BadInput(f"{path} is not a range image: it must begin with rows, columns and pixels", DAMAGED)
    rows, cols = int(match[1]), int(match[2])
    check_grid(path, rows, cols)
    return rows, cols, match.end()
