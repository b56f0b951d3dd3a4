"""The page by the straight lengths of the edges, by their lengths along the surface, or between the two.

A straight edge is too short over a bend or a crease. A length along the surface is nearer, but wrong where noise, or a
crease that no vertex samples, has misled its patches. Which of them contradict each other less tells which to believe.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from restore.flattening.gauss_newton import least_absolute_strain, mean_strain, minimise_strain
from restore.flattening.repair import repaired
from restore.flattening.solution import Solution
from restore.mesh.measures import face_signs
from restore.mesh.network import Network, make_network
from restore.mesh.surface_lengths import surface_lengths
from restore.mesh.validate import ValidMesh
from restore.scan import FlatMesh, Floats

CLEARLY = 0.9  # of the disagreement of straight lengths, at most: nearer by less may be chance


def with_surface_lengths(page: FlatMesh, mesh: ValidMesh) -> FlatMesh:
    """The page of a mesh by the lengths along its surface, if they agree clearly better than straight lengths.

    page: the one of least squares by straight lengths.

    Where they do not, any length of an edge between the two is as good: the page is that of the least absolute
    differences from both, and its rest lengths are the nearest to it between them.
    """
    edges = mesh.sides.edges
    straight = make_network(mesh.vertices, mesh.faces, page.lengths, mesh.sides)
    along = make_network(mesh.vertices, mesh.faces, surface_lengths(mesh.vertices, mesh.faces, edges), mesh.sides)
    squares = minimise_strain(page.flat, along)
    if mean_strain(squares.flat, along) <= CLEARLY * mean_strain(page.flat, straight):
        start = squares._replace(iterations=page.steps + squares.iterations)
        return _page(page, mesh, least_absolute_strain(start, along), along)
    found = least_absolute_strain(Solution(page.flat, page.steps), straight, along.lengths)
    between = np.linalg.norm(found.flat[edges[:, 0]] - found.flat[edges[:, 1]], axis=1)
    shorter, longer = np.minimum(straight.lengths, along.lengths), np.maximum(straight.lengths, along.lengths)
    return _page(page, mesh, found, replace(straight, lengths=np.clip(between, shorter, longer)))


def _page(page: FlatMesh, mesh: ValidMesh, found: Solution, network: Network) -> FlatMesh:
    flat: Floats = repaired(found.flat, network, face_signs(mesh.vertices, mesh.faces))
    steps, residual, converged = found.iterations, found.residual, found.converged
    return replace(page, flat=flat, lengths=network.lengths, steps=steps, residual=residual, converged=converged)
