"""The page as a model for browsers: surface, flat positions and strain in 32 bits.

"PLM1", the length of the header (4 bytes), the header in JSON, then the arrays, all little endian, each at a multiple
of four bytes after the header. The header names each array with its type, its shape and its place.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from restore import FlatMesh, RestoredPage
from restore.drawing import average_at_vertices
from restore.scan import Floats
from station.page_files.mesh import unit_square
from station.pictures.frames import Frame

MAGIC = b"PLM1"
MAX_HEADER_BYTES = 2**16
ALIGNED = 4
TYPES = {"float32": np.dtype("<f4"), "uint32": np.dtype("<u4")}
MM_PER_INCH = 25.4
MIN_FRAMES = 3  # with the start and the end alone there is nothing to be seen between them
Arrays = Mapping[str, NDArray[Any]]


class StoredArray(BaseModel):
    """Where an array is in the block: its type, its shape, its first byte after the header."""

    model_config = ConfigDict(strict=True)
    type: Literal["float32", "uint32"]
    shape: Annotated[list[Annotated[int, Field(ge=0, le=2**31)]], Field(max_length=3)]
    offset: int = Field(ge=0)


class Header(BaseModel):
    """The arrays of a block; any further key is a fact."""

    model_config = ConfigDict(strict=True, extra="allow")
    arrays: dict[str, StoredArray]


def encode_model(page: RestoredPage, frames: Sequence[Frame]) -> bytes:
    """Encode the model of a page.

    frames: steps of the flattening, kept where the sheet moves through space.
    """
    mesh = page.fine
    arrays: dict[str, NDArray[Any]] = {
        "vertices": centred(mesh.vertices),
        "faces": mesh.faces,
        "flat": centred(mesh.flat),
        "strain": average_at_vertices(mesh.face_strain[:, :1], mesh.faces, len(mesh.flat))[:, 0],
        "page_uv": page_uv(page),
    }
    if mesh.texcoords is not None and mesh.texture is not None:
        arrays["uv"] = unit_square(mesh.texcoords, *mesh.texture.shape[:2])
    return encode_arrays({**arrays, **_steps(frames, page.flat)}, {"dpi": page.dpi})


def centred(points: Floats) -> Floats:
    """Points (n, k) with the middle of their bounding box at the origin."""
    return np.asarray(points - (points.min(axis=0) + points.max(axis=0)) / 2)


def page_uv(page: RestoredPage) -> Floats:
    """Return positions (n, 2) of the vertices of the fine mesh on the page's picture.

    0 to 1, v upwards; outside of it where a crop took them away.
    """
    flat, (height, width) = page.fine.flat, page.image.shape[:2]
    corner = np.array([flat[:, 0].min(), flat[:, 1].max()])
    right, down = ((flat - corner) * [1.0, -1.0] * page.dpi / MM_PER_INCH - page.trimmed[:2]).T
    return np.column_stack([right / width, 1.0 - down / height])


def encode_arrays(arrays: Arrays, facts: Mapping[str, Any]) -> bytes:
    """Encode arrays and JSON values as one block of bytes.

    The arrays are floats or indices.
    """
    place, described, parts = 0, {}, list[bytes]()
    for name, array in arrays.items():
        kind = "float32" if np.issubdtype(array.dtype, np.floating) else "uint32"
        data = np.ascontiguousarray(array, TYPES[kind]).tobytes()
        described[name] = {"type": kind, "shape": list(array.shape), "offset": place}
        parts.append(data)
        place += len(data)
    header = json.dumps({**facts, "arrays": described}, sort_keys=True, separators=(",", ":")).encode()
    header += b" " * (-len(header) % ALIGNED)
    return b"".join([MAGIC, len(header).to_bytes(4, "little"), header, *parts])


def decode_arrays(data: bytes) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Decode the arrays (…) and the facts of `encode_arrays`.

    Raises ValueError for what it did not write.
    """
    length = int.from_bytes(data[4:8], "little")
    if data[:4] != MAGIC or length > min(MAX_HEADER_BYTES, len(data)):
        raise ValueError("it is not a model")
    header = Header.model_validate_json(data[8 : 8 + length])
    arrays, start = {}, 8 + length
    for name, one in header.arrays.items():
        kind, count = TYPES[one.type], math.prod(one.shape)
        if start + one.offset + count * kind.itemsize > len(data):
            raise ValueError(f"{name} reaches beyond the end")
        arrays[name] = np.frombuffer(data, kind, count, start + one.offset).reshape(one.shape)
    return arrays, dict(header.model_extra or {})


def _steps(frames: Sequence[Frame], mesh: FlatMesh) -> dict[str, NDArray[Any]]:
    """Return the recorded steps of the flattening.

    Where the method moves the sheet through space and has one position for each vertex.
    """
    sizes = {len(frame.positions) for frame in frames}
    if len(frames) < MIN_FRAMES or len(sizes) != 1 or not any(np.ptp(frame.positions[:, 2]) for frame in frames):
        return {}
    positions = np.stack([frame.positions for frame in frames])
    middle = (positions[-1].min(axis=0) + positions[-1].max(axis=0)) / 2
    steps: dict[str, NDArray[Any]] = {
        "steps.positions": positions - middle,
        "steps.step": np.array([frame.step for frame in frames], np.int64),
        "steps.faces": frames[0].faces,
    }
    if mesh.texcoords is not None and mesh.texture is not None and sizes == {len(mesh.vertices)}:
        steps["steps.uv"] = unit_square(mesh.texcoords, *mesh.texture.shape[:2])
    return steps
