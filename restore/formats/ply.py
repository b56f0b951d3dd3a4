"""`.ply`: Stanford polygon file, text or binary, with a picture or a colour per vertex."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput
from restore.findings import Finding
from restore.formats.cleaning.bare_faces import kept_faces
from restore.formats.cleaning.packing import MAX_PICTURES, pack
from restore.formats.obj import file_name
from restore.formats.parsing.grid import check_grid, grid_polygons
from restore.formats.parsing.mesh import (
    PaintedMesh,
    check_polygons,
    checked_mesh,
    colours_from,
    fan_triangles,
    split_seams,
    texture_uv,
)
from restore.formats.parsing.picture import encode_png, read_image
from restore.formats.parsing.source import DAMAGED, MISSING, ONE_SHOT, find_reference, read_bytes
from restore.formats.ply_data import PlyData, parse_ply
from restore.scan import Bytes, Floats, Ints, Mask, SurfaceMesh

# Names that are in use.
CORNERS = ("vertex_indices", "vertex_index")
TEXCOORDS = (("texture_u", "texture_v"), ("u", "v"), ("s", "t"))
COLOURS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
PICTURE = b"texturefile"


def read_ply(path: Path, texture: Bytes | None = None) -> PaintedMesh:
    """Read a mesh, its texture coordinates or its colours.

    texture: (h, w, 3), replaces its picture.
    Raises BadInput.
    """
    return ply_mesh(path, parse_ply(path, read_bytes(path)), texture)


def ply_mesh(path: Path, content: PlyData, texture: Bytes | None = None) -> PaintedMesh:
    """Return the mesh of a parsed file, as `read_ply`.

    texture: (h, w, 3) uint8 RGB.
    """
    columns = content.columns.get("vertex", {})
    vertices = columns_of(columns, "xyz")
    if vertices is None:
        raise BadInput(f"{path} has no vertices with x, y and z", DAMAGED)
    faces, uv_faces, uv, of_faces = _faces(path, content)
    if uv is None:
        uv = next((found for names in TEXCOORDS if (found := columns_of(columns, names)) is not None), None)
    colours = colours_of(content, "vertex")
    if colours is None:
        colours = _colours_of_faces(content, len(vertices))
    pictures = [] if texture is None else [texture]
    if texture is None and uv is not None:
        pictures = _pictures(path, content.header.comments)
        texture = pictures[0] if pictures else None
    findings: tuple[Finding, ...] = ()
    if uv_faces is not None and uv is not None:
        bare: Mask = np.any(uv_faces < 0, axis=1)
        kept, findings = kept_faces(bare, pictured=texture is not None)
        if bare[kept].any():
            uv = None
        else:
            count = len(uv)
            several = len(pictures) > 1
            chosen = np.clip(of_faces[kept, None], 0, len(pictures) - 1) * count if several else 0
            take, take_uv, faces = split_seams(faces[kept], uv_faces[kept] + chosen, count * max(len(pictures), 1))
            vertices, uv, colours = vertices[take], uv[take_uv % count], None if colours is None else colours[take]
            if several:
                texture, uv = pack(path, pictures, uv, take_uv // count, faces)
                findings = (*findings, Finding.of("pictures_packed", count=len(pictures)))
    return checked_mesh(path, vertices, faces, uv=uv, texture=texture, colours=colours, findings=findings)


def write_ply(mesh: SurfaceMesh, path: Path) -> None:
    """Write a mesh as binary PLY without loss.

    When it has a texture, that is written as .png next to it.
    """
    fields, columns, comment = ["x", "y", "z"], [mesh.vertices], ""
    if mesh.texture is not None and mesh.texcoords is not None:
        fields, columns = fields + ["s", "t"], columns + [texture_uv(mesh.texcoords, mesh.texture)]
        comment = f"comment TextureFile {path.stem}.png\n"
        path.with_suffix(".png").write_bytes(encode_png(mesh.texture))
    header = (
        f"ply\nformat binary_little_endian 1.0\n{comment}element vertex {len(mesh.vertices)}\n"
        + "".join(f"property double {field}\n" for field in fields)
        + f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.zeros(len(mesh.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    path.write_bytes(header.encode() + np.hstack(columns).astype("<f8").tobytes() + faces.tobytes())


def columns_of(columns: dict[str, NDArray[Any]], names: str | tuple[str, ...]) -> Floats | None:
    """Return the numbers (n, k) of the named properties, None when one of them is missing."""
    if not all(name in columns for name in names):
        return None
    with np.errstate(invalid="ignore"):  # of a NaN that signals
        return np.column_stack([columns[name].astype(np.float64, copy=False) for name in names])


def colours_of(content: PlyData, of: str) -> Bytes | None:
    """Return the colours (n, 3) of the elements of a name.

    Under any name that is in use, of the type that the header says.
    """
    columns = content.columns.get(of, {})
    kinds = {p.name: p.kind for element in content.header.elements if element.name == of for p in element.properties}
    for names in COLOURS:
        if all(name in columns for name in names) and len(columns[names[0]]):
            with np.errstate(invalid="ignore"):  # of a NaN that signals, or a text of other numbers than its header
                return colours_from(np.column_stack([columns[name].astype(kinds[name]) for name in names]))
    return None


def _colours_of_faces(content: PlyData, count: int) -> Bytes | None:
    """Return the mean colours (count, 3) of the faces round each vertex.

    Where the file gives a colour to each face.
    """
    colours = colours_of(content, "face")
    corners = next(
        (lists[name] for lists in [content.lists.get("face", {})] for name in CORNERS if name in lists), None
    )
    if colours is None or corners is None or not len(corners.values):
        return None
    vertex, spread = corners.values.astype(np.int64), np.repeat(colours, corners.sizes, axis=0).astype(np.float64)
    if vertex.min() < 0 or vertex.max() >= count:
        return None
    fraction = 1.0 / np.maximum(np.bincount(vertex, minlength=count), 1)
    means = [np.bincount(vertex, channel, count) * fraction for channel in spread.T]
    return np.rint(np.stack(means, axis=1)).astype(np.uint8)


def _strips(path: Path, content: PlyData) -> Ints | None:
    """Return the triangles (m, 3) of strips.

    As the Stanford repository and MeshLab write them; −1 parts one from the next.
    """
    lists = content.lists.get("tristrips", {})
    found = next((lists[name] for name in CORNERS if name in lists), None)
    if found is None:
        return None
    parted = np.full(len(found.values) + len(found.sizes), -1)
    parted[np.arange(len(found.values)) + np.repeat(np.arange(len(found.sizes)), found.sizes)] = found.values
    _check_indices(path, parted[parted != -1], len(content.columns["vertex"]["x"]))
    places = np.arange(len(parted))
    begin = np.maximum.accumulate(np.where(parted < 0, places + 1, 0))
    corners = np.stack([parted[:-2], parted[1:-1], parted[2:]], axis=1)
    whole = (corners >= 0).all(axis=1)
    odd = ((places - begin)[:-2] % 2 == 1)[:, None]
    return np.where(odd, corners[:, [1, 0, 2]], corners)[whole].astype(np.int64)


def _faces(path: Path, content: PlyData) -> tuple[Ints, Ints | None, Floats | None, Ints]:
    """Return the triangles (m, 3) of faces.

    With texture coordinates of corners also their numbers (m, 3), −1 for a face whose list is empty, and the
    coordinates (t, 2). The last is the number of the picture of each triangle.
    """
    lists = content.lists.get("face", {})
    corners = next((lists[name] for name in CORNERS if name in lists), None)
    none = np.empty(0, np.int64)
    if corners is None:
        strips = _strips(path, content)
        return _range_grid(path, content) if strips is None else strips, None, None, none
    check_polygons(path, corners.sizes)
    _check_indices(path, corners.values, len(content.columns["vertex"]["x"]))
    faces = fan_triangles(corners.values, corners.starts, corners.sizes)
    pairs = lists.get("texcoord")
    if pairs is None or not len(faces) or not len(pairs.values):
        return faces, None, None, none
    textured = pairs.sizes > 0
    if (pairs.sizes != 2 * corners.sizes)[textured].any():
        return faces, None, None, none
    picture = content.columns.get("face", {}).get("texnumber", np.zeros(len(corners.sizes)))
    of_faces = np.repeat(np.nan_to_num(picture.astype(np.float64)), np.maximum(corners.sizes - 2, 0)).astype(np.int64)
    coordinates = np.ascontiguousarray(pairs.values, np.float64).view(np.complex128)  # each compared as one number
    uv, number = np.unique(coordinates, return_inverse=True)
    numbers = np.full(len(corners.values), -1)
    numbers[np.repeat(textured, corners.sizes)] = number
    of_corners = fan_triangles(numbers, corners.starts, corners.sizes)
    return faces, of_corners, uv.view(np.float64).reshape(-1, 2), of_faces


def _range_grid(path: Path, content: PlyData) -> Ints:
    """Return the triangles (m, 3) of a file that is a grid of samples.

    As the Stanford scanning repository writes it. Each cell has the list of its sample, empty where nothing was
    measured; `obj_info` has the size of the grid.
    """
    cells = content.lists.get("range_grid", {}).get("vertex_indices")
    if cells is None:
        return np.empty((0, 3), np.int64)
    cols, rows = (_note(content, name) for name in (b"num_cols", b"num_rows"))
    check_grid(path, rows, cols)
    if rows * cols != len(cells.sizes) or cells.sizes.max() > 1:
        raise BadInput(f"{path}: its range grid has not one sample for each of {cols} × {rows} cells", DAMAGED)
    vertices = columns_of(content.columns["vertex"], "xyz")
    assert vertices is not None
    _check_indices(path, cells.values, len(vertices))
    quads, triangles = grid_polygons((cells.sizes == 1).reshape(rows, cols))
    faces = cells.values.astype(np.int64)[np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]], triangles])]
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    to_scanner = np.cross(b - a, c - a)[:, 2].sum() >= 0  # the rows run up in some files, and down in others
    return faces if to_scanner else faces[:, ::-1]


def _note(content: PlyData, name: bytes) -> int:
    """Return the number behind a name in the obj_info lines, or 0."""
    numbers = [words[1] for note in content.header.notes if len(words := note.split()) == 2 and words[0] == name]
    return int(numbers[0]) if numbers and numbers[0].isdigit() and len(numbers[0]) < 10 else 0


def _check_indices(path: Path, indices: NDArray[Any], count: int) -> None:
    wrong = ~((indices >= 0) & (indices < count))
    if wrong.any():
        raise BadInput(f"{path}: a face uses vertex {indices[np.argmax(wrong)]:g} of {count}", DAMAGED)


def _pictures(path: Path, comments: tuple[bytes, ...]) -> list[Bytes]:
    """The pictures that the file names, in the order of their numbers."""
    texture_files = (comment.partition(b" ") for comment in comments)
    names = [file_name(name.strip()) for key, _, name in texture_files if key.lower() == PICTURE]
    if len(names) > MAX_PICTURES:
        raise BadInput(f"{path} names {len(names)} images, a scan has one or some", ONE_SHOT)
    found = []
    for name in names:
        file = find_reference(path, own_name(path, name))
        if file is None:
            raise BadInput(f"{path}: its image {name!r} is missing", MISSING)
        found.append(read_image(file))
    return found


def own_name(path: Path, name: str) -> str:
    """The name of a picture, in which <this> stands for the name of the file itself."""
    return name.replace("<this>", path.stem)
