"""Places that a program wrote apart by its rounding.

They are the seams between parts, and the corners of loose triangles. Only vertices on the border are moved: to the mean
of those that belong to one place. They stay separate vertices, because each may have its own texture coordinates;
merging vertices of one place does the rest.
"""

from __future__ import annotations

from dataclasses import replace
from math import sqrt
from typing import TypeVar

import numpy as np
from scipy.spatial import cKDTree

from restore.findings import Finding
from restore.mesh.adjacency import components
from restore.mesh.places import first_at_place
from restore.mesh.topology import Topology
from restore.numerics.robust import NEARLY_ALL
from restore.scan import Floats, SurfaceMesh, with_findings

Mesh = TypeVar("Mesh", bound=SurfaceMesh)

SINGLE = 1e-6  # of the largest coordinate: single precision and what is computed in it, ten of its last places
OF_MEAN_EDGE = 1e-3  # no program means two places that are nearer to each other
MAX_DECIMALS = 6
MAX_OF_EDGE = 0.1  # of an edge than which nearly all are longer: farther apart, two vertices may be two places
GAP = 2.0  # no distance lies between the largest that is rounding and this multiple of it
SAMPLE = 20_000  # vertices that suffice to count those near each other
CROWDED = 64  # vertices near one: a mesh with more is a cloud of triangles, which cannot be assigned


def joined_by_rounding(mesh: Mesh) -> Mesh:
    """Return the mesh with one position for vertices set apart by rounding.

    Only border vertices are moved; a finding counts them. How far apart they may be follows from the numbers of the
    file. Vertices farther apart are joined, too, where a gap in the distances between vertices distinguishes them from
    the edges, as in parts that were fitted to each other. Without such vertices the mesh itself is returned.
    """
    place = first_at_place(mesh.vertices)
    border = Topology(place[mesh.faces]).border
    lengths = _edge_lengths(mesh)
    lengths = lengths[lengths > 0.0]
    if not len(border) or not len(lengths):
        return mesh
    points, most = mesh.vertices[border], MAX_OF_EDGE * float(np.quantile(lengths, 1.0 - NEARLY_ALL))
    least = min(_rounding(mesh.vertices, float(lengths.mean())), most)
    tree = cKDTree(points)
    if most <= 0.0 or _crowded(tree, points, GAP * most):
        return mesh
    pairs = tree.query_pairs(GAP * most, output_type="ndarray")
    apart = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    reach = _reach(np.sort(apart), least, most)
    near = pairs[apart <= reach]
    if not len(near):
        return mesh
    group = components(near, len(border))
    means = np.stack([np.bincount(group, axis) for axis in points.T], axis=1) / np.bincount(group)[:, None]
    moved = mesh.vertices.copy()
    moved[border] = means[group]
    moved = moved[place]
    count = int((np.bincount(group)[group] > 1).sum())
    found = Finding.of("seams_joined", count=count, reach=float(apart[apart <= reach].max()))
    return with_findings(replace(mesh, vertices=moved), found)


def _edge_lengths(mesh: SurfaceMesh) -> Floats:
    """Return the lengths (3·m,) mm of the sides of all faces."""
    corners = mesh.vertices[mesh.faces]
    return np.asarray(np.sqrt(((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2)).ravel())


def _rounding(vertices: Floats, edge: float) -> float:
    """Return how far apart the numbers of a file may set one place, mm.

    vertices: (n, 3).
    edge: mean length.
    """
    return max(SINGLE * float(np.abs(vertices).max()), _last_decimal(vertices) * sqrt(3.0), OF_MEAN_EDGE * edge)


def _last_decimal(vertices: Floats) -> float:
    """Return the last decimal of coordinates (n, 3), mm, 0 where they have more than a few."""
    for decimals in range(MAX_DECIMALS):
        scaled = vertices * 10.0**decimals
        if (np.abs(scaled - np.rint(scaled)) < SINGLE).all():
            return float(10.0**-decimals)
    return 0.0


def _crowded(tree: cKDTree, points: Floats, reach: float) -> bool:
    """Whether more vertices lie within reach of each other than can be of one place."""
    chosen = points[:: max(1, len(points) // SAMPLE)]
    return float(np.mean(tree.query_ball_point(chosen, reach, return_length=True))) > CROWDED


def _reach(apart: Floats, least: float, most: float) -> float:
    """Return the largest distance that is rounding: `least`, or that at a gap of distances.

    apart: (k,), ascending.
    """
    reach = least
    while reach <= most:
        beyond = int(np.searchsorted(apart, GAP * reach, side="right"))
        if beyond == np.searchsorted(apart, reach, side="right"):
            return reach
        reach = float(apart[beyond - 1])
    return least
