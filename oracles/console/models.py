"""Models of a canned page, in the console's format: a header in JSON, then arrays in little endian."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oracles.console.pictures import SHEET_MM

FRAMES = 8  # of the sheet on its way into the plane


def model(kind: str, points: int) -> bytes:
    """A sheet that curls, in the console's format; a mesh has a twentieth of the points of a scan."""
    count = points if kind == "scan" else max(points // 20, 100)
    columns = round((count * 4 / 3) ** 0.5)
    lines = count // columns
    v, u = (part.ravel() for part in np.mgrid[0 : 1 : lines * 1j, 0 : 1 : columns * 1j])
    flat = np.column_stack([(u - 0.5) * SHEET_MM[0], (v - 0.5) * SHEET_MM[1]])
    arrays: dict[str, NDArray[Any]] = {"uv": np.column_stack([u, v]).astype("<f4")}
    extra: dict[str, Any] = {}
    if kind == "scan":
        arrays["vertices"] = curled(flat, 1.0)
    elif kind == "mesh":
        arrays |= {
            "vertices": curled(flat, 1.0),
            "strain": (np.sin(6 * u) * 0.004).astype("<f4"),
            "flat": flat.astype("<f4"),
            "page_uv": arrays["uv"],
        }
        extra = {"strain_end": 0.01, "page_mm": list(SHEET_MM)}
    else:
        shares = np.linspace(1.0, 0.0, FRAMES)
        arrays |= {
            "positions": np.stack([curled(flat, share) for share in shares]),
            "step": np.arange(FRAMES, dtype="<u4"),
        }
    if kind != "scan":
        arrays["faces"] = grid_faces(lines, columns)
    return packed({"kind": kind, "texture": "/api/pictures/1/page/full", **extra}, arrays)


def curled(flat: NDArray[Any], share: float) -> NDArray[Any]:
    """(n, 3) mm: a flat sheet (n, 2) mm with a share of its curl."""
    x, y = flat.T
    return np.column_stack([x, y, 24.0 * share * np.cos(x / 28.0) + 6.0 * share * np.sin(y / 40.0)]).astype("<f4")


def grid_faces(lines: int, columns: int) -> NDArray[Any]:
    """(m, 3) the triangles of a grid of points."""
    corner = (np.arange(lines - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    upper = np.column_stack([corner, corner + 1, corner + columns])
    return np.vstack([upper, np.column_stack([corner + 1, corner + columns + 1, corner + columns])]).astype("<u4")


def packed(header: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> bytes:
    """A model's bytes: magic, header, arrays (…) in little endian."""
    described, parts, offset = {}, [], 0
    for name, values in arrays.items():
        raw = np.ascontiguousarray(values).tobytes()
        described[name] = {"type": values.dtype.name, "shape": list(values.shape), "offset": offset}
        parts.append(raw)
        offset += len(raw)
    text = json.dumps({**header, "arrays": described}).encode()
    text += b" " * (-len(text) % 4)
    return b"PLM1" + np.uint32(len(text)).tobytes() + text + b"".join(parts)
