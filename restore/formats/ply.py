"""`.ply`: Stanford polygon file, text or binary, with a picture (`comment TextureFile`) or a colour for each vertex."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput
from restore.findings import Finding
from restore.formats.bare_faces import kept_faces
from restore.formats.grid import check_grid, grid_polygons
from restore.formats.mesh import check_polygons, checked_mesh, colours_from, fan_triangles, split_seams, texture_uv
from restore.formats.obj import file_name
from restore.formats.picture import encode_png, read_picture
from restore.formats.ply_data import PlyData, parse_ply
from restore.formats.source import DAMAGED, MISSING, ONE_SHOT, is_file, read_bytes, resolve_reference
from restore.scan import Bytes, Floats, Ints, Mask, SurfaceMesh

# Names that are in use.
CORNERS = ("vertex_indices", "vertex_index")
TEXCOORDS = (("texture_u", "texture_v"), ("u", "v"), ("s", "t"))
COLOURS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
PICTURE = b"texturefile"


def read_ply(path: Path, texture: Bytes | None = None) -> SurfaceMesh:
    """Read a mesh, its texture coordinates or its colours; `texture` (h, w, 3) replaces its picture.

    Raises BadInput.
    """
    content = parse_ply(path, read_bytes(path))
    columns = content.columns.get("vertex", {})
    vertices = _columns(columns, "xyz")
    if vertices is None:
        raise BadInput(f"{path} has no vertices with x, y and z", DAMAGED)
    faces, uv_faces, uv = _faces(path, content)
    if uv is None:
        uv = next((found for names in TEXCOORDS if (found := _columns(columns, names)) is not None), None)
    colours = _colours(content)
    if texture is None and uv is not None:
        texture = _picture(path, content.header.comments)
    findings: tuple[Finding, ...] = ()
    if uv_faces is not None and uv is not None:
        bare: Mask = np.any(uv_faces < 0, axis=1)
        kept, findings = kept_faces(bare, pictured=texture is not None)
        if bare[kept].any():
            uv = None
        else:
            take, take_uv, faces = split_seams(faces[kept], uv_faces[kept], len(uv))
            vertices, uv, colours = vertices[take], uv[take_uv], None if colours is None else colours[take]
    return checked_mesh(path, vertices, faces, uv=uv, texture=texture, colours=colours, findings=findings)


def write_ply(mesh: SurfaceMesh, path: Path) -> None:
    """Write a mesh as binary PLY without loss, and when it has a texture that as .png beside it."""
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


def _columns(columns: dict[str, NDArray[Any]], names: str | tuple[str, ...]) -> Floats | None:
    """(n, k) numbers of the named properties, None when one of them is missing."""
    if not all(name in columns for name in names):
        return None
    with np.errstate(invalid="ignore"):  # of a NaN that signals
        return np.column_stack([columns[name].astype(np.float64, copy=False) for name in names])


def _colours(content: PlyData) -> Bytes | None:
    """The colours (n, 3) of the vertices, under any name that is in use, and of the type that the header says."""
    columns = content.columns["vertex"]
    kinds = {
        p.name: p.kind for element in content.header.elements if element.name == "vertex" for p in element.properties
    }
    for names in COLOURS:
        if all(name in columns for name in names) and len(columns[names[0]]):
            with np.errstate(invalid="ignore"):  # of a NaN that signals, or a text of other numbers than its header
                return colours_from(np.column_stack([columns[name].astype(kinds[name]) for name in names]))
    return None


def _faces(path: Path, content: PlyData) -> tuple[Ints, Ints | None, Floats | None]:
    """Triangles (m, 3); with texture coordinates of corners also their numbers (m, 3) and the coordinates (t, 2).

    The numbers are −1 for a face whose list is empty.
    """
    lists = content.lists.get("face", {})
    corners = next((lists[name] for name in CORNERS if name in lists), None)
    if corners is None:
        return _range_grid(path, content), None, None
    check_polygons(path, corners.sizes)
    _check_indices(path, corners.values, len(content.columns["vertex"]["x"]))
    faces = fan_triangles(corners.values, corners.starts, corners.sizes)
    pairs = lists.get("texcoord")
    if pairs is None or not len(faces) or not len(pairs.values):
        return faces, None, None
    textured = pairs.sizes > 0
    if (pairs.sizes != 2 * corners.sizes)[textured].any():
        return faces, None, None
    coordinates = np.ascontiguousarray(pairs.values, np.float64).view(np.complex128)  # each compared as one number
    uv, number = np.unique(coordinates, return_inverse=True)
    numbers = np.full(len(corners.values), -1)
    numbers[np.repeat(textured, corners.sizes)] = number
    return faces, fan_triangles(numbers, corners.starts, corners.sizes), uv.view(np.float64).reshape(-1, 2)


def _range_grid(path: Path, content: PlyData) -> Ints:
    """Triangles (m, 3) of a file that is a grid of samples, as the Stanford scanning repository writes it.

    Each cell has the list of its sample, empty where nothing was measured; `obj_info` has the size of the grid.
    """
    cells = content.lists.get("range_grid", {}).get("vertex_indices")
    if cells is None:
        return np.empty((0, 3), np.int64)
    cols, rows = (_note(content, name) for name in (b"num_cols", b"num_rows"))
    check_grid(path, rows, cols)
    if rows * cols != len(cells.sizes) or cells.sizes.max() > 1:
        raise BadInput(f"{path}: its range grid has not one sample for each of {cols} × {rows} cells", DAMAGED)
    vertices = _columns(content.columns["vertex"], "xyz")
    assert vertices is not None
    _check_indices(path, cells.values, len(vertices))
    quads, triangles = grid_polygons((cells.sizes == 1).reshape(rows, cols))
    faces = cells.values.astype(np.int64)[np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]], triangles])]
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    to_scanner = np.cross(b - a, c - a)[:, 2].sum() >= 0  # the rows run up in some files, and down in others
    return faces if to_scanner else faces[:, ::-1]


def _note(content: PlyData, name: bytes) -> int:
    """The number behind a name in the obj_info lines, 0 where there is none."""
    numbers = [words[1] for note in content.header.notes if len(words := note.split()) == 2 and words[0] == name]
    return int(numbers[0]) if numbers and numbers[0].isdigit() and len(numbers[0]) < 10 else 0


def _check_indices(path: Path, indices: NDArray[Any], count: int) -> None:
    wrong = ~((indices >= 0) & (indices < count))
    if wrong.any():
        raise BadInput(f"{path}: a face uses vertex {indices[np.argmax(wrong)]:g} of {count}", DAMAGED)


def _picture(path: Path, comments: tuple[bytes, ...]) -> Bytes | None:
    texture_files = (comment.partition(b" ") for comment in comments)
    names = {file_name(name.strip()) for key, _, name in texture_files if key.lower() == PICTURE}
    if len(names) > 1:
        raise BadInput(f"{path} uses {len(names)} pictures, a scan has one", ONE_SHOT)
    if not names:
        return None
    file = resolve_reference(path, name := names.pop())
    if not is_file(file):
        raise BadInput(f"{path}: its picture {name!r} is missing", MISSING)
    return read_picture(file)
