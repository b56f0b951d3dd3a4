"""Decimates a dense mesh, keeping more points where the sheet bends."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Lock
from types import ModuleType
from typing import Any

import numpy as np

from restore.errors import NotEnoughSurface
from restore.runtime.native import load_pymeshlab
from restore.scan import Floats, Ints

TOLERANCE = 0.03  # of the points requested
QUALITY = 0.5  # of an equilateral triangle: collapses that leave thinner ones come last
# The boundary may be simplified, but moving it costs as much as moving the surface: at 1 corners move, at 100 the
# border keeps its points and the page has too few.
BOUNDARY_WEIGHT = 10.0
MAX_ATTEMPTS = 6
MAX_HOLE_EDGES = 100  # more than the border of a drop-out in a printed figure, less than that of the page
SMOOTHING_STEPS = 5  # twenty would round creases
ALONE = Lock()  # pymeshlab's filters have a common state: two at a time damage the memory of the process


def decimate(vertices: Floats, faces: Ints, points: int, *, own_vertices: bool = False) -> tuple[Floats, Ints]:
    """Collapse edges by quadric error until about `points` are left.

    The border is free and vertices move to where the quadric is least (Garland & Heckbert 1997), on a crease to the
    crease itself; with `own_vertices` the result is a subset of the vertices. A mesh of no more points than requested
    is returned unchanged.
    vertices: (n, 3) mm.
    faces: (m, 3).
    Raises NotEnoughSurface when nothing is left, LibraryMissing when pymeshlab cannot be loaded.
    """
    if len(vertices) <= points * (1 + TOLERANCE):
        return vertices, faces
    denser, sparser, sparser_faces, target = (vertices, faces), 0, 0, 2 * points
    for _ in range(MAX_ATTEMPTS):
        reduced = _collapse(*denser, target, own_vertices)
        count = len(reduced[0])
        if abs(count - points) <= TOLERANCE * points:
            break
        if count > points:
            denser = reduced
        else:
            sparser, sparser_faces = count, len(reduced[1])
        # Inside a mesh two faces go with a vertex, along ragged borders one: the rate of the last attempts is used.
        rate = (len(denser[1]) - sparser_faces) / max(len(denser[0]) - sparser, 1)
        target = sparser_faces + round((points - sparser) * rate)
    if len(reduced[1]) == 0:
        raise NotEnoughSurface("nothing of the mesh is left after reduction", "ask for more points")
    return reduced


def _collapse(vertices: Floats, faces: Ints, target: int, own_vertices: bool) -> tuple[Floats, Ints]:
    with _loaded(vertices, faces) as (_, meshes):
        meshes.meshing_decimation_quadric_edge_collapse(
            targetfacenum=max(target, 2),
            qualitythr=QUALITY,
            preserveboundary=False,
            boundaryweight=BOUNDARY_WEIGHT,
            preservenormal=True,
            optimalplacement=not own_vertices,
            planarquadric=True,
            autoclean=True,
        )
        return _arrays(meshes)


def patch_and_smooth(vertices: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Close the small holes of a raw mesh, and smooth it without shrinking.

    vertices: (n, 3) mm.
    faces: (m, 3). Source: Taubin 1995.
    """
    with _loaded(vertices, faces) as (pymeshlab, meshes):
        # Closing selects the new faces, and filters after it would work on those alone.
        with suppress(pymeshlab.PyMeshLabException):  # a mesh that is not two-manifold keeps its holes
            meshes.meshing_close_holes(maxholesize=MAX_HOLE_EDGES, newfaceselected=False)
        meshes.apply_coord_taubin_smoothing(stepsmoothnum=SMOOTHING_STEPS, selected=False)
        return _arrays(meshes)


@contextmanager
def _loaded(vertices: Floats, faces: Ints) -> Iterator[tuple[ModuleType, Any]]:
    """pymeshlab and a set of meshes that holds this one, for one thread at a time."""
    pymeshlab = load_pymeshlab()
    with ALONE:
        meshes = pymeshlab.MeshSet()
        meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
        yield pymeshlab, meshes


def _arrays(meshes: Any) -> tuple[Floats, Ints]:
    mesh = meshes.current_mesh()
    return np.array(mesh.vertex_matrix(), dtype=np.float64, order="C"), np.array(
        mesh.face_matrix(), dtype=np.int64, order="C"
    )
