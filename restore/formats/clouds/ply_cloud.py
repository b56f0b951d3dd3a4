"""Point clouds in Stanford polygon files, which have vertices and no faces.

Organised where a remark states the size of the grid (`obj_info num_cols` and `num_rows` as in the Stanford 3D Scanning
Repository, `comment width` and `height` of others), or the order of the points shows one.
"""

from __future__ import annotations

from pathlib import Path

from restore.errors import BadInput
from restore.formats.clouds.cloud import Cloud, Size, cloud_of
from restore.formats.clouds.grid_size import sized, stated_size
from restore.formats.parsing.source import DAMAGED
from restore.formats.ply import colours_of, columns_of
from restore.formats.ply_data import PlyData

FACES = ("face", "tristrips", "range_grid")
NORMALS = ("nx", "ny", "nz")
INTENSITIES = ("intensity", "scalar_intensity", "grey", "gray", "confidence")


def ply_cloud(path: Path, content: PlyData, size: Size | None) -> Cloud:
    """Return the cloud of a parsed file without faces.

    size: of its grid, where it was given.
    Raises BadInput.
    """
    columns = content.columns.get("vertex", {})
    points = columns_of(columns, "xyz")
    if points is None:
        raise BadInput(f"{path} has no vertices with x, y and z", DAMAGED)
    intensity = next((columns[name] for name in INTENSITIES if name in columns), None)
    normals = columns_of(columns, NORMALS)
    cloud = cloud_of(path, points, colours_of(content, "vertex"), intensity, normals=normals)
    stated = stated_size([*content.header.comments, *content.header.notes], len(points))
    return sized(path, cloud, size, stated)


def has_faces(content: PlyData) -> bool:
    """Return whether a parsed file has, or promises, faces, strips or a range grid."""
    return any(element.count for element in content.header.elements if element.name in FACES)
