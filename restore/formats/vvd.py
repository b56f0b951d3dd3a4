"""`.vvd`: an element file of the scanner's own software, as far as its layout is known.

All big-endian: 132 bytes beginning with "VIVID", of unknown meaning otherwise; int32 number of vertices; three float64
each, mm; int32 number of faces; for each an int32 count, 3 or 4, and as many int32 vertex numbers. What follows (the
colour image) is of unknown layout and left out. Known from what other open readers of the format agree on.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from restore.errors import BadInput
from restore.formats.grid import grid_polygons
from restore.formats.mesh import checked_mesh, fan_triangles
from restore.formats.picture import encode_png
from restore.formats.source import DAMAGED, read_bytes
from restore.scan import Bytes, Ints, RangeScan, SurfaceMesh

MAGIC = b"VIVID"
HEADER_BYTES = 132
VERTEX_BYTES = 24
CORNERS = (3, 4)


def read_vvd(path: Path, texture: Bytes | None = None) -> SurfaceMesh:
    """Read the vertices and faces of an element file; `texture` (h, w, 3).

    Raises BadInput, also for variants not known yet.
    """
    data = read_bytes(path)
    if not data.startswith(MAGIC):
        raise BadInput(f"{path} is no element file: it must begin with {MAGIC.decode()}", DAMAGED)
    count, body = _count(path, data, HEADER_BYTES, VERTEX_BYTES, "vertices")
    vertices = np.frombuffer(data, ">f8", 3 * count, body).reshape(-1, 3)
    faces, first = _count(path, data, body + VERTEX_BYTES * count, 4 * (1 + min(CORNERS)), "faces")
    longest = faces * (1 + max(CORNERS))  # behind the faces come other things
    words = np.frombuffer(data, ">i4", min(longest, (len(data) - first) // 4), first).astype(np.int64)
    starts, counts = _face_offsets(path, words, faces)
    return checked_mesh(path, vertices, fan_triangles(words, starts, counts), texture=texture)


def write_vvd(scan: RangeScan, path: Path) -> None:
    """Write the measured samples and the polygons between them, and the picture beside as PNG."""
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
    """The count at `offset` and the offset behind it; the file must be long enough for so many items."""
    if offset + 4 > len(data):
        raise BadInput(f"{path} ends before the number of its {what}", DAMAGED)
    count: int = struct.unpack_from(">i", data, offset)[0]
    if not 0 < count <= (len(data) - offset - 4) // item_bytes:
        raise BadInput(f"{path} claims {count} {what}, which its {len(data)} bytes cannot hold", DAMAGED)
    return count, offset + 4


def _face_offsets(path: Path, words: Ints, faces: int) -> tuple[Ints, Ints]:
    """Offset (m,) of the first corner of each face, and number of corners (m,), by following the counts."""
    starts, at, run = [], 1, words.tolist()
    for face in range(faces):
        if at > len(run) or run[at - 1] not in CORNERS:
            raise BadInput(f"{path}: face {face} is cut off or has not 3 or 4 corners", DAMAGED)
        starts.append(at)
        at += run[at - 1] + 1
    if at - 1 > len(run):
        raise BadInput(f"{path}: its last face is cut off", DAMAGED)
    return np.array(starts), words[np.array(starts) - 1]
