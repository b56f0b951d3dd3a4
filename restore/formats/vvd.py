"""`.vvd`: element file of the scanner's software, as far as known.

All big-endian: 132 bytes beginning with "VIVID", of unknown meaning otherwise; int32 number of vertices; three float64
each, mm; int32 number of faces; for each an int32 count, 3 or 4, and as many int32 vertex numbers. What follows (the
colour image) is of unknown layout and left out. Known from what other open readers of the format agree on.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from restore.errors import BadInput
from restore.formats.parsing.grid import grid_polygons
from restore.formats.parsing.mesh import Numbers, PaintedMesh, check_counts, checked_mesh, fan_triangles
from restore.formats.parsing.picture import encode_png
from restore.formats.parsing.records import find_lists, gather
from restore.formats.parsing.source import CUT_SHORT, DAMAGED, read_bytes
from restore.scan import Bytes, RangeScan

MAGIC = b"VIVID"
HEADER_BYTES = 132
VERTEX_BYTES = 24
CORNERS = (3, 4)


def read_vvd(path: Path, texture: Bytes | None = None) -> PaintedMesh:
    """Read the vertices and faces of an element file; `texture` (h, w, 3).

    Raises BadInput, also for variants not known yet.
    """
    data = read_bytes(path)
    if not data.startswith(MAGIC):
        raise BadInput(f"{path} is not an element file: it must begin with {MAGIC.decode()}", DAMAGED)
    count, body = _count(path, data, HEADER_BYTES, VERTEX_BYTES, "vertices")
    vertices = np.frombuffer(data, ">f8", 3 * count, body).reshape(-1, 3)
    faces, first = _count(path, data, body + VERTEX_BYTES * count, 4 * (1 + min(CORNERS)), "faces")
    check_counts(path, count, faces)
    corners, sizes = _polygons(path, np.frombuffer(data, np.uint8), first, faces)
    return checked_mesh(path, vertices, fan_triangles(corners, np.cumsum(sizes) - sizes, sizes), texture=texture)


def write_vvd(scan: RangeScan, path: Path) -> None:
    """Write the measured samples and the polygons between them.

    The picture is written next to the file as PNG.
    """
    measured = scan.measured
    points, polygons = scan.points[measured], grid_polygons(measured)
    with path.open("wb") as file:
        file.write(MAGIC.ljust(HEADER_BYTES, b"\0") + struct.pack(">i", len(points)) + points.astype(">f8").tobytes())
        file.write(struct.pack(">i", sum(map(len, polygons))))
        for part in polygons:
            file.write(np.insert(part, 0, part.shape[1], axis=1).astype(">i4").tobytes())
    if scan.texture is not None:
        path.with_suffix(".png").write_bytes(encode_png(scan.texture))


def _count(path: Path, data: bytes, offset: int, item_bytes: int, what: str) -> tuple[int, int]:
    """Return the count at `offset` and the offset behind it.

    The file must be long enough for that many items.
    """
    if offset + 4 > len(data):
        raise BadInput(f"{path} seems cut short: it ends before the number of its {what}", CUT_SHORT)
    count: int = struct.unpack_from(">i", data, offset)[0]
    if not 0 < count <= (len(data) - offset - 4) // item_bytes:
        fault = f"claims {count} {what}, which its {len(data)} bytes cannot hold"
        if count > 0:
            raise BadInput(f"{path} seems cut short: it {fault}", CUT_SHORT)
        raise BadInput(f"{path} {fault}", DAMAGED)
    return count, offset + 4


def _polygons(path: Path, content: Bytes, first: int, faces: int) -> tuple[Numbers, Numbers]:
    """Corners of all faces, one behind the other, and number of corners (m,) of each."""
    starts, sizes = np.zeros((1, faces), np.int32), np.full((1, faces), CORNERS[0], np.int32)
    end = find_lists(content, first, np.array([4]), np.array([4]), True, starts, sizes)
    wrong = (sizes[0] < min(CORNERS)) | (sizes[0] > max(CORNERS))
    if wrong.any():
        raise BadInput(f"{path}: face {np.argmax(wrong)} has not 3 or 4 corners", DAMAGED)
    if end < 0:
        raise BadInput(f"{path} seems cut short: its faces are not complete", CUT_SHORT)
    corners = np.empty(4 * int(sizes.sum()), np.uint8)
    gather(content, starts[0], sizes[0], 4, corners)
    return corners.view(">i4").astype(np.int32), sizes[0]
