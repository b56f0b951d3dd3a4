"""Choice between straight edge lengths and lengths along the surface.

A straight length is too short over a bend or a crease. A length along the surface is more accurate, but wrong where
noise, or a crease that no vertex samples, has misled its patches. The set of lengths that contradicts itself less is
the better one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from restore.flattening.isometric.gauss_newton import least_absolute_strain, mean_strain, minimise_strain
from restore.flattening.isometric.repair import repaired
from restore.flattening.solution import Solution
from restore.mesh.measures import face_signs
from restore.mesh.network import Network, make_network
from restore.mesh.validate import ValidMesh
from restore.page import FlatMesh
from restore.scan import Floats


def with_surface_lengths(page: FlatMesh, mesh: ValidMesh, along: Floats) -> FlatMesh:
    """Return the page by surface lengths, unless straight ones agree better.

    Where surface lengths contradict each other less, any length of an edge between the two is as good: the page is that
    of the least absolute differences from both, and its rest lengths are the nearest to it between them.
    page: that of least squares by straight lengths.
    along: (e,) mm, along the surface.
    """
    edges = mesh.topology.edges
    straight = make_network(mesh.vertices, mesh.topology, page.lengths)
    surface = make_network(mesh.vertices, mesh.topology, along)
    squares = minimise_strain(page.flat, surface)
    if mean_strain(squares.flat, surface) <= mean_strain(page.flat, straight):
        start = squares._replace(iterations=page.iterations + squares.iterations)
        return _page(mesh, least_absolute_strain(start, surface), surface)
    found = least_absolute_strain(Solution(page.flat, page.iterations), straight, surface.lengths)
    between = np.linalg.norm(found.flat[edges[:, 0]] - found.flat[edges[:, 1]], axis=1)
    shorter, longer = np.sort([straight.lengths, surface.lengths], axis=0)
    return _page(mesh, found, replace(straight, lengths=np.clip(between, shorter, longer)))


def _page(mesh: ValidMesh, found: Solution, network: Network) -> FlatMesh:
    flat: Floats = repaired(found.flat, network, face_signs(mesh.vertices, mesh.faces))
    return FlatMesh.of(mesh, flat, network.lengths, found.iterations, **found.convergence)
