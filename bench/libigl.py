"""What libigl's users flatten with: LSCM, ARAP (Liu et al. 2008) and SLIM (Rabinovich et al. 2017).

All start from the conformal map at the true scale. ARAP and SLIM go on until they move no more: till between two looks,
LOOK iterations apart, the vertices have moved less than STILL_MM rms; at most MOST iterations, on large meshes half.
"""

from __future__ import annotations

from collections.abc import Callable

import igl
import numpy as np

from restore.flattening.conformal import far_apart
from restore.mesh.measures import surface_area
from restore.scan import Floats, SurfaceMesh

LOOK = 5
MOST = 100
LARGE = 20_000  # vertices
STILL_MM = 0.0005  # what tells two results apart in these tables


def lscm(mesh: SurfaceMesh) -> Floats:
    """The conformal map, scaled to the area of the surface, as ours is."""
    held = np.array(far_apart(mesh.vertices))
    found, _ = igl.lscm(mesh.vertices, mesh.faces, held, np.array([[0.0, 0.0], [1.0, 0.0]]))
    area = surface_area(np.column_stack([found, np.zeros(len(found))]), mesh.faces)
    return np.asarray(found * np.sqrt(surface_area(mesh.vertices, mesh.faces) / area))


def arap(mesh: SurfaceMesh) -> Floats:
    """As rigid as possible from the conformal map, one vertex held, without which libigl refuses."""
    start = lscm(mesh)
    data = igl.ARAPData()
    data.max_iter = LOOK
    igl.arap_precomputation(mesh.vertices, mesh.faces, 2, np.array([0], np.int32), data)
    return _until_still(lambda flat: np.asarray(igl.arap_solve(start[:1], data, flat)), start)


def slim(mesh: SurfaceMesh) -> Floats:
    """Scalable locally injective mapping (symmetric Dirichlet) from the conformal map, no vertex held."""
    start = lscm(mesh)
    data = igl.slim_precompute(
        np.asfortranarray(mesh.vertices),
        np.asfortranarray(mesh.faces, dtype=np.int32),
        np.asfortranarray(start),
        igl.MappingEnergyType.SYMMETRIC_DIRICHLET,
        np.empty(0, np.int32),
        np.asfortranarray(np.empty((0, 2))),
        0.0,
    )
    return _until_still(lambda _: np.array(igl.slim_solve(data, LOOK))[:, :2], start)


def _until_still(iterate: Callable[[Floats], Floats], flat: Floats) -> Floats:
    for _ in range((MOST if len(flat) < LARGE else MOST // 2) // LOOK):
        before, flat = flat, iterate(flat)
        if np.sqrt(((flat - before) ** 2).sum(axis=1).mean()) < STILL_MM:
            break
    return flat
