"""Checks the raw arrays of a mesh file: no native library receives invalid ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput
from restore.findings import Finding
from restore.formats.parsing.picture import adjacent_picture
from restore.formats.parsing.source import DAMAGED, MAX_SAMPLES, NO_FACES, ONE_SHOT
from restore.formats.parsing.tiles import in_first_tile
from restore.mesh.adjacency import used_vertices
from restore.numerics.robust import MAJORITY
from restore.numerics.units import MAX_COORDINATE_MM
from restore.scan import Bytes, Floats, Ints, Mask, Provenance, SurfaceMesh

# Vertices of the largest range grid: six times MAX_SAMPLES, as STL repeats each sample for its triangles.
MAX_ITEMS = 6 * MAX_SAMPLES
# Two for each sample of the largest range camera, 1280 × 1024, and a little above.
MAX_FACES = 3 * 2**20
MAX_CORNERS = 256  # of a face; scanners write triangles and quads, editors no more than some dozens
Numbers = NDArray[np.int32]  # of vertices or corners, half as large as Ints
MAX_TEXCOORD = 100.0  # tiles of a picture that repeats; UDIM has ten in a row, and files few rows


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
    findings: Sequence[Finding] = (),
) -> PaintedMesh:
    """Check the arrays of a mesh file and make a mesh of them.

    Unused vertices and collapsed faces are removed. Faces with a vertex that is not a number are left out, with a
    finding, as a hole. Without texture and colours, or with one colour alone, the picture next to the file is taken. A
    texture without uv is kept: its place may follow from the scanner's geometry. uv without a texture mean nothing and
    are dropped, with a finding.
    vertices: (n, 3) mm.
    faces: (m, 3).
    uv: (n, 2), with the origin at the lower left of the texture, which may repeat.
    colours: (n, 3) RGB.
    Raises BadInput.
    """
    points: Floats = _columns(path, "vertices", vertices, 3).astype(np.float64, copy=False)
    corners: Ints = _columns(path, "faces", faces, 3).astype(np.int64, copy=False)
    check_counts(path, len(points), 0)
    _check_faces(path, corners, len(points))
    corners, holes = _finite_faces(path, points, corners)
    collapsed = (corners[:, 0] == corners[:, 1]) | (corners[:, 1] == corners[:, 2]) | (corners[:, 2] == corners[:, 0])
    if collapsed.any():
        corners = corners[~collapsed]
    used = used_vertices(corners, len(points))
    if not used.any():
        raise BadInput(f"{path} holds no surface: it has no triangle", NO_FACES)
    if not used.all():
        corners = (np.cumsum(used) - 1)[corners]
        points, uv, colours = points[used], None if uv is None else uv[used], None if colours is None else colours[used]
    check_vertices(path, points)
    if colours is not None and (colours == colours[0]).all():  # what programs write for want of colours
        colours = None
    if texture is None and colours is None:
        texture = adjacent_picture(path)
    texcoords = None if uv is None or texture is None else _texcoords(path, uv, texture, points, corners)
    facts = provenance(path)
    unpainted = [Finding.of("no_picture")] if uv is not None and texture is None and colours is None else []
    found = (*findings, *holes, *unpainted)
    return PaintedMesh(points, corners, texcoords, texture, facts, colours=colours, findings=found)


def _finite_faces(path: Path, vertices: Floats, faces: Ints) -> tuple[Ints, list[Finding]]:
    """Return the faces (m, 3) whose vertices (n, 3) are all numbers.

    Returns also a finding of those that are left out. Raises BadInput where these are most.
    """
    broken: Mask = ~np.all(np.isfinite(vertices), axis=1)
    if not broken.any():
        return faces, []
    lost: Mask = np.any(broken[faces], axis=1)
    if lost.sum() > MAJORITY * len(lost):
        first = int(np.argmax(broken))
        x, y, z = vertices[first]
        raise BadInput(f"{path}: vertex {first} lies at ({x:g}, {y:g}, {z:g}) mm, and most faces have such", DAMAGED)
    return faces[~lost], [
        Finding.of("faces_not_finite", int(lost.sum()) / len(lost), count=int(lost.sum()))
    ] if lost.any() else []


def provenance(path: Path) -> Provenance:
    """Provenance of a scan that was read from a file."""
    return {"file": path.name}


def _columns(path: Path, what: str, array: NDArray[Any], width: int) -> NDArray[Any]:
    if array.ndim != 2 or array.shape[1] != width:
        raise BadInput(f"{path}: its {what} have not {width} numbers each", DAMAGED)
    return array


def check_vertices(path: Path, vertices: Floats) -> None:
    """Raise BadInput for too many vertices (n, 3) mm, or invalid ones.

    One is not finite or out of range.
    """
    check_counts(path, len(vertices), 0)
    bad = ~np.logical_and.reduce([np.abs(axis) <= MAX_COORDINATE_MM for axis in vertices.T])
    if bad.any():
        first = int(np.argmax(bad))
        x, y, z = vertices[first]
        raise BadInput(f"{path}: vertex {first} lies at ({x:g}, {y:g}, {z:g}) mm", DAMAGED)


def check_counts(path: Path, vertices: int, faces: int) -> None:
    """Raise BadInput for more vertices or faces than one shot of any scanner has."""
    for count, limit, what in ((vertices, MAX_ITEMS, "vertices"), (faces, MAX_FACES, "faces")):
        if count > limit:
            raise BadInput(f"{path} has {count} {what}, more than {limit}", ONE_SHOT)


def check_polygons(path: Path, sizes: NDArray[np.integer]) -> None:
    """Raise BadInput for polygons of too many corners or triangles.

    sizes: (m,), corners of each; all triangles are counted.
    """
    if len(sizes) and sizes.max() > MAX_CORNERS:
        raise BadInput(f"{path}: a face has {sizes.max()} corners, more than {MAX_CORNERS}", DAMAGED)
    check_counts(path, 0, int(np.maximum(sizes - 2, 0).sum()))


def _check_faces(path: Path, faces: Ints, count: int) -> None:
    check_counts(path, 0, len(faces))
    if len(faces) and (faces.min() < 0 or faces.max() >= count):
        bad = int(np.argmax(((faces < 0) | (faces >= count)).any(axis=1)))
        raise BadInput(f"{path}: a face uses vertices {faces[bad].tolist()} of {count}", DAMAGED)


def _texcoords(path: Path, uv: NDArray[np.floating], texture: Bytes, vertices: Floats, faces: Ints) -> Floats:
    coordinates: Floats = _columns(path, "texture coordinates", uv, 2).astype(np.float64)
    bad = ~(np.abs(coordinates) <= MAX_TEXCOORD).all(axis=1)
    if bad.any():
        first = int(np.argmax(bad))
        (u, v), (x, y, z) = coordinates[first], vertices[first]
        what = "lies far outside the image" if np.isfinite((u, v)).all() else "is not a number"
        raise BadInput(
            f"{path}: the texture coordinate ({u:g}, {v:g}) of the vertex at ({x:g}, {y:g}, {z:g}) mm {what}", DAMAGED
        )
    return texture_pixels(in_first_tile(path, coordinates, faces), texture)


def colours_from(values: NDArray[Any]) -> Bytes:
    """Convert colours to uint8 RGB.

    Floats are fractions of 1 or numbers up to 255, whole numbers go up to the largest of their type; what is not a
    number is black.
    values: (n, 3). Returns (n, 3).
    """
    if values.dtype.kind == "f":
        scale = 255.0 if np.nanmax(values, initial=0.0) <= 1.0 else 1.0
    else:
        scale = 255.0 / np.iinfo(values.dtype).max if values.dtype.itemsize == 2 else 1.0
    return np.clip(np.rint(np.nan_to_num(values.astype(np.float64)) * scale), 0, 255).astype(np.uint8)


def texture_pixels(uv: Floats, texture: Bytes) -> Floats:
    """Convert uv in 0…1, v up, to texture pixels, y down.

    The first pixel's centre is at 0.
    uv: (n, 2). Returns (n, 2).
    """
    height, width = texture.shape[:2]
    return np.column_stack([uv[:, 0] * width - 0.5, (1.0 - uv[:, 1]) * height - 0.5])


def texture_uv(texcoords: Floats, texture: Bytes) -> Floats:
    """Convert texture pixels to texture coordinates (u, v): the inverse of `texture_pixels`.

    texcoords: (n, 2), of a picture (h, w, 3). Returns (n, 2).
    """
    height, width = texture.shape[:2]
    return np.column_stack([(texcoords[:, 0] + 0.5) / width, 1.0 - (texcoords[:, 1] + 0.5) / height])


def fan_triangles(indices: NDArray[np.integer], starts: NDArray[np.integer], counts: NDArray[np.integer]) -> Ints:
    """Split polygons into triangles (m, 3), all from the polygon's first corner.

    Polygon k has the corners indices[starts[k] : starts[k] + counts[k]]; those with fewer than three give nothing.
    All numbers are below 2^31.
    """
    triangles = np.empty((int(np.maximum(counts - 2, 0).sum(dtype=np.int64)), 3), np.int64)
    _fan(*(array.astype(np.int32, copy=False) for array in (indices, starts, counts)), triangles)
    return triangles


@numba.njit(cache=True)
def _fan(indices: Numbers, starts: Numbers, counts: Numbers, triangles: Ints) -> None:
    at = 0
    for k in range(len(counts)):
        first = indices[starts[k]] if counts[k] > 2 else 0
        for corner in range(starts[k] + 2, starts[k] + counts[k]):
            triangles[at, 0], triangles[at, 1], triangles[at, 2] = first, indices[corner - 1], indices[corner]
            at += 1


def split_seams(faces: Ints, uv_faces: Ints, uv_count: int) -> tuple[Ints, Ints, Ints]:
    """Give every used pair of vertex and texture coordinate a vertex.

    Returns the vertices and the texture coordinates to take (k,), (k,), and the faces (m, 3) among them.
    """
    if len(faces) == 0:
        return np.empty(0, np.int64), np.empty(0, np.int64), faces
    count = int(faces.max()) + 1
    only = np.zeros(count, np.int64)
    only[faces] = uv_faces
    if (only[faces] == uv_faces).all():  # without seams, as scanners write it
        return np.arange(count), only, faces
    corner_vertex, corner_uv = faces.reshape(-1), uv_faces.reshape(-1)
    order = _sorted_by(corner_uv, np.arange(faces.size, dtype=np.int32), uv_count)
    order = _sorted_by(corner_vertex, order, count)
    pairs, numbers = np.empty((faces.size, 2), np.int32), np.empty(faces.size, np.int64)
    used = _number_pairs(corner_vertex, corner_uv, order, pairs, numbers)
    take, take_uv = pairs[:used].astype(np.int64).T
    return take, take_uv, numbers.reshape(faces.shape)


@numba.njit(cache=True)
def _sorted_by(keys: Ints, order: Numbers, count: int) -> Numbers:
    """Sort an order (c,) stably by keys (c,).

    The keys are below `count`: a counting sort, linear in both.
    """
    first = np.zeros(count + 1, np.int32)
    for key in keys:
        first[key + 1] += 1
    for k in range(count):
        first[k + 1] += first[k]
    result = np.empty_like(order)
    for k in order:
        result[first[keys[k]]] = k
        first[keys[k]] += 1
    return result


@numba.njit(cache=True)
def _number_pairs(first: Ints, second: Ints, order: Numbers, pairs: Numbers, numbers: Ints) -> int:
    """Number the distinct pairs of corners that are sorted by both.

    Returns how many pairs exist.
    """
    used = 0
    for k in order:
        if used == 0 or pairs[used - 1, 0] != first[k] or pairs[used - 1, 1] != second[k]:
            pairs[used, 0], pairs[used, 1] = first[k], second[k]
            used += 1
        numbers[k] = used - 1
    return used
