"""Validation of the raw arrays of a mesh file, so that no native library receives invalid ones."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput
from restore.formats.picture import adjacent_picture
from restore.formats.source import DAMAGED, MAX_COORDINATE_MM, MAX_SAMPLES, ONE_SHOT
from restore.scan import Bytes, Floats, Ints, SurfaceMesh

# Vertices, and faces, of the largest range grid: six times MAX_SAMPLES, as STL repeats each sample for its triangles.
MAX_ITEMS = 6 * MAX_SAMPLES
# Repeating textures leave [0, 1]; a scan's never do by more than its border.
MAX_TEXCOORD = 2.0


@dataclass(frozen=True, eq=False)
class PaintedMesh(SurfaceMesh):
    """A surface mesh with a colour for each vertex instead of texture coordinates.

    colours  (n, 3) uint8 RGB, or None.
    """

    colours: Bytes | None = None


def checked_mesh(
    path: Path,
    vertices: NDArray[np.floating],
    faces: NDArray[np.integer],
    *,
    uv: NDArray[np.floating] | None = None,
    texture: Bytes | None = None,
    colours: Bytes | None = None,
) -> SurfaceMesh:
    """Check the arrays of a mesh file and make a SurfaceMesh of them, without unused vertices and collapsed faces.

    vertices (n, 3) mm, faces (m, 3), uv (n, 2) with the origin at the lower left of the texture, colours (n, 3) RGB.
    Without texture and colours the picture beside the file is taken. A texture without uv is kept: its place may follow
    from the scanner's geometry. uv without a texture mean nothing and are dropped. Raises BadInput.
    """
    points: Floats = _columns(path, "vertices", vertices, 3).astype(np.float64)
    corners: Ints = _columns(path, "faces", faces, 3).astype(np.int64)
    check_vertices(path, points)
    _check_faces(path, corners, len(points))
    collapsed = (corners == np.roll(corners, 1, axis=1)).any(axis=1)
    corners = corners[~collapsed]
    used, number = _used_vertices(corners, len(points))
    if not used.size:
        raise BadInput(f"{path} holds no surface: it has no triangle", "export the scan with its faces")
    if texture is None and colours is None:
        texture = adjacent_picture(path)
    return PaintedMesh(
        points[used],
        number[corners],
        _texcoords(path, uv, used, texture),
        texture,
        provenance(path),
        colours=None if colours is None else colours[used],
    )


def _used_vertices(corners: Ints, count: int) -> tuple[Ints, Ints]:
    """The vertices (k,) that the corners use, of `count`; and the number (count,) of each among them."""
    seen = np.zeros(count, bool)
    seen[corners] = True
    return np.flatnonzero(seen), np.cumsum(seen) - 1


def provenance(path: Path) -> dict[str, str]:
    """Provenance of a scan that was read from a file."""
    return {"file": path.name}


def _columns(path: Path, what: str, array: NDArray[Any], width: int) -> NDArray[Any]:
    if array.ndim != 2 or array.shape[1] != width:
        raise BadInput(f"{path}: its {what} have not {width} numbers each", DAMAGED)
    return array


def check_vertices(path: Path, vertices: Floats) -> None:
    """Raise BadInput for too many vertices (n, 3) mm, or one that is not finite or out of range."""
    if len(vertices) > MAX_ITEMS:
        raise BadInput(f"{path} has {len(vertices)} vertices, more than {MAX_ITEMS}", ONE_SHOT)
    bad = np.flatnonzero(~(np.abs(vertices) <= MAX_COORDINATE_MM).all(axis=1))
    if bad.size:
        x, y, z = vertices[bad[0]]
        raise BadInput(f"{path}: vertex {bad[0]} lies at ({x:g}, {y:g}, {z:g}) mm", DAMAGED)


def _check_faces(path: Path, faces: Ints, count: int) -> None:
    bad = np.flatnonzero(((faces < 0) | (faces >= count)).any(axis=1))
    if bad.size:
        raise BadInput(f"{path}: a face uses vertices {faces[bad[0]].tolist()} of {count}", DAMAGED)


def _texcoords(path: Path, uv: NDArray[np.floating] | None, used: Ints, texture: Bytes | None) -> Floats | None:
    if uv is None or texture is None:
        return None
    uv = _columns(path, "texture coordinates", uv, 2).astype(np.float64)[used]
    if not (np.abs(uv) <= MAX_TEXCOORD).all():
        raise BadInput(f"{path}: a texture coordinate lies far outside the picture", DAMAGED)
    return texture_pixels(uv, texture)


def texture_pixels(uv: Floats, texture: Bytes) -> Floats:
    """(n, 2) pixels, y down, the first pixel's centre at 0, from uv (n, 2) in 0…1, v up."""
    height, width = texture.shape[:2]
    return np.column_stack([uv[:, 0] * width - 0.5, (1.0 - uv[:, 1]) * height - 0.5])


def texture_uv(texcoords: Floats, texture: Bytes) -> Floats:
    """(n, 2) texture coordinates (u, v) of texture pixels (n, 2) of a picture (h, w, 3); see `texture_pixels`."""
    height, width = texture.shape[:2]
    return np.column_stack([(texcoords[:, 0] + 0.5) / width, 1.0 - (texcoords[:, 1] + 0.5) / height])


def fan_triangles(indices: Ints, starts: Ints, counts: Ints) -> Ints:
    """Split polygons into triangles (m, 3), all from the polygon's first corner.

    Polygon k has the corners indices[starts[k] : starts[k] + counts[k]]; those with fewer than three give nothing.
    """
    triangles = np.maximum(counts - 2, 0)
    first = np.repeat(starts, triangles)
    step = np.arange(triangles.sum()) - np.repeat(np.cumsum(triangles) - triangles, triangles)
    return np.column_stack([indices[first], indices[first + step + 1], indices[first + step + 2]]).astype(np.int64)


def split_seams(faces: Ints, uv_faces: Ints, uv_count: int) -> tuple[Ints, Ints, Ints]:
    """Give every pair of (vertex, texture coordinate) that the faces use a vertex of its own.

    Returns the vertices and the texture coordinates to take (k,), (k,), and the faces (m, 3) among them.
    """
    if len(faces) == 0:
        return np.empty(0, np.int64), np.empty(0, np.int64), faces
    only = np.zeros(faces.max() + 1, np.int64)
    only[faces] = uv_faces
    if (only[faces] == uv_faces).all():  # without seams, as scanners write it
        return np.arange(len(only)), only, faces
    pairs, inverse = np.unique(faces.ravel() * uv_count + uv_faces.ravel(), return_inverse=True)
    return pairs // uv_count, pairs % uv_count, inverse.reshape(faces.shape).astype(np.int64)
