"""Scan files: `load_scan(path)` reads any of them.

Each module holds one format, its reader and its writer.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, TypeVar

from restore.errors import BadInput
from restore.formats.abs import read_abs, write_abs
from restore.formats.captures import is_captures, read_captures
from restore.formats.cleaning.copies import merge_copies
from restore.formats.cleaning.rounding import joined_by_rounding
from restore.formats.cleaning.seams import without_seams
from restore.formats.cleaning.texture_map import with_oriented_map
from restore.formats.cleaning.vertex_colours import with_picture
from restore.formats.clouds.arrays import read_arrays
from restore.formats.clouds.cloud import MAX_BYTES, Cloud, Size, scaled
from restore.formats.clouds.depth_image import DEPTHS, check_depth, is_depth_folder, read_depth
from restore.formats.clouds.e57 import read_e57
from restore.formats.clouds.grid_size import parse_grid
from restore.formats.clouds.intrinsics import intrinsics_in
from restore.formats.clouds.loose import loose_scan
from restore.formats.clouds.organised import organised_scan
from restore.formats.clouds.pcd import read_pcd
from restore.formats.clouds.ply_cloud import has_faces, ply_cloud
from restore.formats.clouds.ptx import read_ptx
from restore.formats.clouds.text import read_text
from restore.formats.folder import read_folder, save_scan
from restore.formats.gltf.glb import read_glb, read_gltf
from restore.formats.obj import read_obj, write_obj
from restore.formats.parsing.mesh import PaintedMesh
from restore.formats.parsing.picture import SUFFIXES as IMAGE_SUFFIXES
from restore.formats.parsing.picture import encode_png, read_image
from restore.formats.parsing.png import png_parts
from restore.formats.parsing.source import is_file, is_folder, read_bytes, scan_stem
from restore.formats.parsing.unit import AUTO, check_unit, in_millimetres, of_voxels, rescale_mesh
from restore.formats.ply import ply_mesh, write_ply
from restore.formats.ply_data import parse_ply
from restore.formats.references import referenced_files
from restore.formats.stl import read_stl
from restore.formats.tifxyz import is_tifxyz, read_tifxyz
from restore.formats.vcps import read_vcps
from restore.formats.vrml import read_vrml, write_vrml
from restore.formats.vvd import read_vvd, write_vvd
from restore.mesh.ordered_grid import GridMesh
from restore.numerics.units import UNSTATED
from restore.range_image.organise import organise
from restore.runtime.arguments import checks_types
from restore.scan import Bytes, RangeScan, SurfaceMesh

__all__ = [
    "COMMON_READERS",
    "IMAGE_SUFFIXES",
    "READERS",
    "SCAN_SUFFIXES",
    "check_depth",
    "check_unit",
    "encode_png",
    "load_scan",
    "parse_grid",
    "png_parts",
    "read_bytes",
    "read_image",
    "referenced_files",
    "rescale_mesh",
    "save_scan",
    "scan_stem",
]
__all__ += ["write_abs", "write_obj", "write_ply", "write_vrml", "write_vvd"]

Read = TypeVar("Read", bound=RangeScan | SurfaceMesh)
FileReader = Callable[[Path, Bytes | None], Read]


class Reading(NamedTuple):
    """How a file is read: its unit, the size of its grid, the kind of its depths."""

    unit: str = AUTO
    grid: Size | None = None
    depth: str = AUTO


Reader = Callable[[Path, Bytes | None, Reading], RangeScan | SurfaceMesh]


def _mesh(read: FileReader[PaintedMesh]) -> Reader:
    return lambda path, picture, how: _on_range_grid(merge_copies(in_millimetres(path, read(path, picture), how.unit)))


def _range_image(read: FileReader[RangeScan]) -> Reader:
    return lambda path, picture, how: _in_its_unit(path, read(path, picture), how.unit)


def _segment(read: FileReader[GridMesh]) -> Reader:
    return lambda path, picture, how: in_millimetres(path, read(path, picture), how.unit, of_voxels)


def _cloud(read: Callable[[Path, Size | None], Cloud]) -> Reader:
    return lambda path, picture, how: _of_cloud(path, read(path, how.grid), picture, how.unit)


def _of_cloud(path: Path, cloud: Cloud, picture: Bytes | None, unit: str) -> RangeScan | SurfaceMesh:
    cloud = scaled(path, cloud, unit)
    if cloud.size is not None:
        return organised_scan(path, cloud, picture)
    if picture is not None:
        raise BadInput(f"{path} is a loose cloud: where the image lies on it is not known", "leave --texture out")
    return loose_scan(path, cloud)


def _depth(path: Path, picture: Bytes | None, how: Reading) -> RangeScan:
    """Read a depth image, in millimetres."""
    return organised_scan(path, read_depth(path, how.unit, how.depth), picture)


def _ply(path: Path, picture: Bytes | None, how: Reading) -> RangeScan | SurfaceMesh:
    content = parse_ply(path, read_bytes(path, MAX_BYTES))
    if has_faces(content):
        return _mesh(lambda path, picture: ply_mesh(path, content, picture))(path, picture, how)
    return _of_cloud(path, ply_cloud(path, content, how.grid), picture, how.unit)


READERS: dict[str, Reader] = {
    ".asc": _cloud(read_text),
    ".e57": _cloud(read_e57),
    ".pts": _cloud(read_text),
    ".ptx": _cloud(read_ptx),
    ".xyz": _cloud(read_text),
    ".abs": _range_image(read_abs),
    ".abs.gz": _range_image(read_abs),
    ".glb": _mesh(read_glb),
    ".gltf": _mesh(read_gltf),
    ".npy": _cloud(read_arrays),
    ".npz": _cloud(read_arrays),
    ".obj": _mesh(read_obj),
    ".pcd": _cloud(read_pcd),
    ".ply": _ply,
    ".stl": _mesh(read_stl),
    ".vcps": _segment(read_vcps),
    ".vvd": _mesh(read_vvd),
    ".wrl": _mesh(read_vrml),
}
COMMON_READERS: dict[str, Reader] = {".csv": _cloud(read_text), ".txt": _cloud(read_text)}
"""Of names that other files have, too: they are not looked for in folders."""
WAYS_ROUND = {
    ".r3d": "the depth inside is in Apple's LZFSE compression: export a mesh (OBJ, GLB, PLY) from Record3D instead",
    ".usdz": "export the scan as GLB, OBJ or PLY",
    ".zip": "unpack it, and give the folder or the file inside",
}
SCAN_SUFFIXES = tuple(READERS)
"""How the names of scan files end, in lower case."""


@checks_types
def load_scan(
    path: Path | str, texture: Path | str | None = None, *, unit: str = AUTO, grid: str = AUTO, depth: str = AUTO
) -> RangeScan | SurfaceMesh:
    r"""Read a scan file or a scan folder.

    A mesh that is one capture of a scanner is returned on its range grid.

    path     a file with one of the extensions of READERS, a folder that `save_scan` wrote, a `tifxyz` folder,
             one of captured patterns of structured light, or one of a depth image with its intrinsics.
    texture  a picture to use instead of the file's own. Without it a file that names none takes the picture of the
             same name in its folder.
    unit     of a mesh's coordinates: mm, cm, m, in, the edge of a voxel as 7.91um, or auto for the unit of the format,
             mm where it has none.
    grid     columns and rows of an organised cloud, as 2064x1544, where its file does not state them.
    depth    of a depth image, where its file leaves it open: along the camera's axis (axis), or of the ray (ray).
    A segment of a CT volume comes back as a GridMesh. Doubled faces are merged, and the charts of a texture atlas put
    together. `provenance` names the unit; `findings` go into the report.
    Raises BadInput for a missing, damaged or unknown file.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "square.obj"
    ...     lines = ["v 0 0 0", "v 10 0 0", "v 10 10 0", "v 0 10 0", "f 1 2 3", "f 1 3 4"]
    ...     _ = path.write_text("\n".join(lines))
    ...     mesh = load_scan(path)
    >>> mesh.vertices.shape, mesh.faces.tolist()
    ((4, 3), [[0, 1, 2], [0, 2, 3]])
    """
    path = Path(path)
    check_unit(unit)
    check_depth(depth)
    how = Reading(unit, parse_grid(grid), depth)
    given_picture = None if texture is None else read_image(Path(texture))
    if is_folder(path):
        if is_tifxyz(path):
            return _segment(read_tifxyz)(path, given_picture, how)
        if is_depth_folder(path):
            return _depth(path, given_picture, how)
        if given_picture is not None:
            raise BadInput(f"{path}: a scan folder has its own image", "leave --texture out")
        return _in_its_unit(path, read_captures(path) if is_captures(path) else read_folder(path), unit)
    scan = _reader(path)(path, given_picture, how)
    if given_picture is not None and scan.texture is None:
        raise BadInput(
            f"{path} does not say where the image {texture} lies on it",
            "export it with texture coordinates, or unmoved in the frame of the scanner",
        )
    return scan


def _reader(path: Path) -> Reader:
    name = path.name.lower()
    for extension, reader in (READERS | COMMON_READERS).items():
        if name.endswith(extension):
            return reader
    if path.suffix.lower() in DEPTHS and is_file(path) and intrinsics_in(path.parent) is not None:
        return _depth
    if not is_file(path):
        read_bytes(path)  # raises what is wrong with it
    kinds = ", ".join(sorted(READERS | COMMON_READERS))
    hint = WAYS_ROUND.get(path.suffix.lower(), f"use a scan folder or one of: {kinds}")
    raise BadInput(f"{path}: scans of this kind are not known", hint)


def _in_its_unit(path: Path, scan: RangeScan, unit: str) -> RangeScan:
    """Return the scan, if its unit is millimetres: that is the unit of all range images.

    Raises BadInput when another was given.
    """
    if unit not in (AUTO, UNSTATED):
        raise BadInput(f"{path} is a range image, its unit is millimetres", "leave --unit out")
    return scan


def _on_range_grid(mesh: PaintedMesh) -> RangeScan | SurfaceMesh:
    """Return the scan on a mesh's range grid; else the mesh, seamless or vertex-coloured.

    Its texture is dropped if it has no coordinates.
    """
    colours = mesh.colours if mesh.texture is None else None
    scan = organise(mesh, colours=colours)
    if scan is not None:
        return scan
    joined = joined_by_rounding(mesh)
    mesh = mesh if joined is mesh else merge_copies(joined)
    if colours is not None:
        return with_picture(mesh, colours)
    texture = None if mesh.texcoords is None else mesh.texture
    plain = SurfaceMesh(mesh.vertices, mesh.faces, mesh.texcoords, texture, mesh.provenance, findings=mesh.findings)
    return without_seams(with_oriented_map(plain))
