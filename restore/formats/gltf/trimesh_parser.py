"""Adapter to trimesh's mesh parsers: bytes in, arrays or BadInput out.

trimesh gets bytes that were read within limits and opens no file; `restore.formats.parsing.picture` reads pictures.
"""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput
from restore.formats.parsing.mesh import MAX_ITEMS, colours_from
from restore.formats.parsing.source import DAMAGED, NO_FACES, ONE_SHOT
from restore.scan import Bytes, Ints, Mask

# A full 640 × 480 shot has 1.5 million lines with normals and texture coordinates. A parser takes 100 bytes a line, be
# it empty.
MAX_LINES = 8_000_000
NUMPY_PARSE_ERROR = "string or file could not be read to its end"  # NumPy's message for text that is not a number


@dataclass(frozen=True, eq=False)
class MeshArrays:
    """One mesh as trimesh gives it, its values not checked yet.

    Vertices (n, 3), faces (m, 3), uv (n, 2) or None, colours (n, 3) or None.
    bare: (m,), True for the faces of parts without texture coordinates, whose uv are 0.
    materials: (n,), the number that is the name of each vertex's material, −1 for another name.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    uv: NDArray[np.float64] | None
    colours: Bytes | None
    bare: Mask
    materials: Ints


class NoFileResolver:
    """A trimesh resolver that opens nothing."""

    def get(self, name: str) -> NoReturn:
        """Refuse."""
        raise FileNotFoundError(name)

    __getitem__ = get


def parse_mesh(path: Path, data: bytes, kind: str, **options: Any) -> MeshArrays:
    """Parse the mesh in the bytes of a file.

    All its parts are transformed and concatenated. Raises BadInput.
    """
    import trimesh

    if kind != "glb" and data.count(b"\n") > MAX_LINES:
        raise BadInput(f"{path} has more than {MAX_LINES} lines", ONE_SHOT)
    with _silence_trimesh(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        # NumPy before 2.3 only warns of text that is not a number, and goes on with what came before it.
        warnings.filterwarnings("error", message=NUMPY_PARSE_ERROR, category=DeprecationWarning)
        try:
            scene = trimesh.load_scene(
                io.BytesIO(data), file_type=kind, resolver=NoFileResolver(), process=False, **options
            )
            return _concatenate(path, _pieces(scene, trimesh))
        except BadInput:
            raise
        except Exception as error:  # parsers raise any exception: IndexError, KeyError, AttributeError, …
            words = NUMPY_PARSE_ERROR in str(error)
            reason = "a word stands where a number should be" if words else str(error) or type(error).__name__
            raise BadInput(f"{path} is not a readable {kind.upper()} file: {reason[:200]}", DAMAGED) from error


@contextmanager
def _silence_trimesh() -> Iterator[None]:
    """Disable trimesh's log inside the block.

    It prints tracebacks of errors that the caller receives anyway.
    """
    logger = logging.getLogger("trimesh")
    before, logger.disabled = logger.disabled, True
    try:
        yield
    finally:
        logger.disabled = before


def _pieces(scene: Any, trimesh: Any) -> list[tuple[NDArray[np.float64], Any]]:
    """Return the vertices and the mesh of each piece that has faces.

    The vertices are moved to where the file puts them.
    """
    places = [scene.graph.get(node) for node in scene.graph.nodes_geometry]
    meshes = [(matrix, scene.geometry[name]) for matrix, name in places]
    meshes = [(matrix, mesh) for matrix, mesh in meshes if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces)]
    # One mesh may be placed in a file a thousand times.
    if max(sum(len(mesh.vertices) for _, mesh in meshes), sum(len(mesh.faces) for _, mesh in meshes)) > MAX_ITEMS:
        raise ValueError(f"it has more than {MAX_ITEMS} vertices or faces")
    for matrix, mesh in meshes:
        if np.linalg.det(matrix[:3, :3]) < 0.0:  # glTF 2.0, section 3.7.4: a mirrored node turns its faces round
            mesh.faces = mesh.faces[:, ::-1]
    return [(trimesh.transform_points(mesh.vertices, matrix), mesh) for matrix, mesh in meshes]


def _concatenate(path: Path, pieces: list[tuple[NDArray[np.float64], Any]]) -> MeshArrays:
    if not pieces:
        raise BadInput(f"{path} holds no surface: it has no triangle", NO_FACES)
    firsts = np.cumsum([0] + [len(vertices) for vertices, _ in pieces])
    for vertices, mesh in pieces:  # a wrong number must not become a right one of the next piece
        if mesh.faces.min() < 0 or mesh.faces.max() >= len(vertices):
            raise BadInput(f"{path}: a face uses vertex {mesh.faces.max()} of {len(vertices)}", DAMAGED)
    return MeshArrays(
        np.concatenate([vertices for vertices, _ in pieces]),
        np.concatenate([mesh.faces + first for (_, mesh), first in zip(pieces, firsts[:-1], strict=True)]),
        _concatenate_uv(pieces),
        _concatenate_attribute(pieces, _colours),
        np.concatenate([np.full(len(mesh.faces), not _has_uv(vertices, mesh)) for vertices, mesh in pieces]),
        np.concatenate([np.full(len(vertices), _material(mesh)) for vertices, mesh in pieces]),
    )


def _concatenate_uv(pieces: list[tuple[NDArray[np.float64], Any]]) -> NDArray[np.float64] | None:
    """Return the texture coordinates of all pieces, 0 where missing, None when all are."""
    if not any(_has_uv(vertices, mesh) for vertices, mesh in pieces):
        return None
    return np.concatenate(
        [_uv(mesh) if _has_uv(vertices, mesh) else np.zeros((len(vertices), 2)) for vertices, mesh in pieces]
    )


def _has_uv(vertices: NDArray[np.float64], mesh: Any) -> bool:
    uv = _uv(mesh)
    return uv is not None and len(uv) == len(vertices)


def _concatenate_attribute(pieces: list[Any], attribute: Callable[[Any], Any]) -> Any:
    """A vertex attribute of all pieces together, None when one of them lacks it."""
    values = [attribute(mesh) for _, mesh in pieces]
    whole = all(value is not None and len(value) == len(v) for value, (v, _) in zip(values, pieces, strict=True))
    return np.concatenate(values) if whole else None


def _uv(mesh: Any) -> Any:
    return getattr(mesh.visual, "uv", None)


def _material(mesh: Any) -> int:
    name = str(getattr(getattr(mesh.visual, "material", None), "name", ""))
    return int(name) if name.isdigit() and len(name) < 6 else -1


def _colours(mesh: Any) -> Any:
    """Return the colours (n, 3) of the vertices, also those next to a material, or None."""
    if mesh.visual.kind == "vertex":
        return np.asarray(mesh.visual.vertex_colors)[:, :3]
    colours = getattr(mesh.visual, "vertex_attributes", {}).get("color")
    return None if colours is None or np.ndim(colours) != 2 else colours_from(np.asarray(colours)[:, :3])
