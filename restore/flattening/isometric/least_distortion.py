"""The least distorted page of a surface that is not developable.

Without inverted faces and with the least symmetric Dirichlet energy, by scalable locally injective mapping (Rabinovich,
Poranne, Panozzo & Sorkine-Hornung 2017, in libigl) from Tutte's embedding on a circle, which inverts no face of a disc.
It knows the faces in space alone, no other lengths.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.sparse import csc_matrix, diags
from scipy.sparse.linalg import splu

from restore.flattening.isometric.gauss_newton import MAX_ITERATIONS
from restore.flattening.solution import Solution
from restore.mesh.measures import signed_areas, surface_area
from restore.mesh.network import Network
from restore.scan import Floats, Ints

STILL = 1e-4  # of its size the page moves in an iteration, rms: it is then within half a per cent of the least energy


def least_distorted_page(vertices: Floats, network: Network) -> Solution:
    """Flatten a disc without inverted faces, at the scale of the surface.

    vertices: (n, 3) mm. Returns flat positions (n, 2) mm.
    """
    import igl

    faces = network.faces
    loop = np.asarray(igl.boundary_loop(faces))
    circle = np.asarray(igl.map_vertices_to_circle(np.ascontiguousarray(vertices), loop))
    start = embedded(network.edges, len(vertices), loop, circle)
    size = float(np.sqrt(surface_area(vertices, faces)))
    start = start * size / np.sqrt(abs(float(signed_areas(start, faces).sum())))
    steps = slim(vertices, faces, start, 1)
    flat, moved, iterations = start, np.inf, 0
    while iterations < MAX_ITERATIONS and moved > STILL:
        iterations += 1
        flat, before = next(steps), flat
        moved = float(np.sqrt(((flat - before) ** 2).sum(axis=1).mean())) / size
    return Solution(flat, iterations, moved, moved <= STILL)


def slim(vertices: Floats, faces: Ints, start: Floats, step: int) -> Iterator[Floats]:
    """Yield the page (n, 2) after each `step` iterations, without end.

    start: (n, 2), without inverted faces.
    """
    import igl

    data = igl.slim_precompute(
        np.asfortranarray(vertices),
        np.asfortranarray(faces, dtype=np.int32),
        np.asfortranarray(start),
        igl.MappingEnergyType.SYMMETRIC_DIRICHLET,
        np.empty(0, np.int32),
        np.asfortranarray(np.empty((0, 2))),
        0.0,
    )
    while True:
        yield np.array(igl.slim_solve(data, step))[:, :2]


def embedded(edges: Ints, count: int, held: Ints, places: Floats) -> Floats:
    """Return Tutte's embedding: each vertex at the mean of its neighbours.

    Where the held vertices are the border of a disc, in order round a convex curve, no face is inverted (Tutte 1963).
    held: (k,).
    places: (k, 2), of the held ones.
    Returns (count, 2).
    """
    a, b = edges.T
    joined = csc_matrix((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, a])), shape=(count, count))
    free = np.setdiff1d(np.arange(count), held)
    laplacian = diags(np.asarray(joined.sum(axis=1)).ravel()) - joined
    flat = np.zeros((count, 2))
    flat[held] = places
    inner = laplacian.tocsc()[free]
    solver = splu(inner[:, free].tocsc(), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    flat[free] = solver.solve(-(inner[:, held] @ places))
    return flat
