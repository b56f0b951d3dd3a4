"""Flattening methods of libigl: LSCM, ARAP (Liu et al. 2008) and SLIM (Rabinovich et al. 2017).

All start from the conformal map at the true scale. ARAP and SLIM iterate until converged: until the vertices move
less than CONVERGED_MM rms in ITERATIONS_PER_CHECK iterations; at most MAX_ITERATIONS, on large meshes half.
"""

from __future__ import annotations

from collections.abc import Callable

import igl
import numpy as np

from restore.flattening.conformal import far_apart
from restore.flattening.isometric import least_distortion
from restore.mesh.measures import surface_area
from restore.scan import Floats, SurfaceMesh

ITERATIONS_PER_CHECK = 5
MAX_ITERATIONS = 100
LARGE = 20_000  # vertices
CONVERGED_MM = 0.0005  # the smallest difference that these tables show


def lscm(mesh: SurfaceMesh) -> Floats:
    """The conformal map, scaled to the area of the surface, as ours is."""
    fixed = np.array(far_apart(mesh.vertices))
    flat, _ = igl.lscm(mesh.vertices, mesh.faces, fixed, np.array([[0.0, 0.0], [1.0, 0.0]]))
    area = surface_area(np.column_stack([flat, np.zeros(len(flat))]), mesh.faces)
    return np.asarray(flat * np.sqrt(surface_area(mesh.vertices, mesh.faces) / area))


def arap(mesh: SurfaceMesh) -> Floats:
    """As rigid as possible from the conformal map, one vertex held, without which libigl refuses."""
    start = lscm(mesh)
    data = igl.ARAPData()
    data.max_iter = ITERATIONS_PER_CHECK
    igl.arap_precomputation(mesh.vertices, mesh.faces, 2, np.array([0], np.int32), data)
    return _iterate_until_converged(lambda flat: np.asarray(igl.arap_solve(start[:1], data, flat)), start)


def slim(mesh: SurfaceMesh) -> Floats:
    """Scalable locally injective mapping (symmetric Dirichlet) from the conformal map, no vertex held."""
    start = lscm(mesh)
    steps = least_distortion.slim(mesh.vertices, mesh.faces, start, ITERATIONS_PER_CHECK)
    return _iterate_until_converged(lambda _: next(steps), start)


def _iterate_until_converged(iterate: Callable[[Floats], Floats], flat: Floats) -> Floats:
    for _ in range((MAX_ITERATIONS if len(flat) < LARGE else MAX_ITERATIONS // 2) // ITERATIONS_PER_CHECK):
        before, flat = flat, iterate(flat)
        if np.sqrt(((flat - before) ** 2).sum(axis=1).mean()) < CONVERGED_MM:
            break
    return flat
