"""Parts of a sheet that hang on the rest by single points.

No edge holds the rotation of such a part about its point; it could overlap the rest of the page. Each part is flattened
separately and attached to its point in the direction of the surface there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from restore.flattening.isometric.gauss_newton import minimise_strain
from restore.flattening.solution import Solution
from restore.mesh.adjacency import Sides, components
from restore.mesh.measures import flipped_faces
from restore.mesh.network import Network, Piece, part_of
from restore.mesh.pose import PosedSheet, move_upright, pose_on_table
from restore.scan import Floats, Ints, Mask

Solve = Callable[[PosedSheet, Piece], Solution]


def flatten_parts(vertices: Floats, piece: Piece, whole: PosedSheet, solve: Solve) -> Solution:
    """Flatten a connected piece of a mesh part by part.

    whole: the mesh, vertices (n, 3) mm, placed on the table: all pieces are seen from one side, and the largest part of
        each comes to lie where the scanner saw it.
    Returns flat positions (k, 2) mm, with the convergence of the slowest part.
    """
    vertices, seen = vertices.take(piece.vertices, axis=0), whole.seen.take(piece.vertices, axis=0)
    flat, placed, tied = np.zeros(seen.shape), np.zeros(len(seen), bool), False
    worst = Solution(flat, 0)
    for part in parts(piece.network):
        if len(part.vertices) == len(whole.seen):
            posed = whole
        else:
            posed = replace(pose_on_table(vertices[part.vertices], part.faces), seen=seen[part.vertices])
        found = solve(posed, part)
        if placed.any():
            posed = _carried_on(posed, vertices, part, piece.network.edges, flat, placed)
        own = move_upright(found.flat, posed)
        joined = placed[part.vertices]
        if joined.any():
            own += (flat[part.vertices] - own)[joined].mean(axis=0)
            tied |= joined.sum() > 1
        flat[part.vertices] = np.where(joined[:, None], flat[part.vertices], own)
        placed[part.vertices] = True
        worst = worst.joined(found)
    return worst._replace(flat=_closed(flat, piece.network) if tied else flat)


def _closed(flat: Floats, network: Network) -> Floats:
    """Return the nearby page of least strain of a piece with cyclic parts.

    The parts of such a piece have several points in common.
    """
    settled = minimise_strain(flat, network).flat
    return settled if flipped_faces(settled, network.faces) <= flipped_faces(flat, network.faces) else flat


def _carried_on(
    posed: PosedSheet, vertices: Floats, part: Piece, edges: Ints, flat: Floats, placed: Mask
) -> PosedSheet:
    """Return a part posed so that the page continues the surface there.

    flat: (k, 2) mm, the page so far, valid where placed (k,). The surface continues at the joints of the part.
    """
    joined = placed[part.vertices]
    joints = part.vertices[joined]
    ends = np.concatenate([edges, edges[:, ::-1]])
    around = ends[np.isin(ends[:, 0], joints) & placed[ends[:, 1]]]
    onward = _onward(flat[around[:, 1]] - flat[around[:, 0]], vertices[around[:, 1]] - vertices[around[:, 0]])
    joint = joints[0]
    seen = flat[joint] + (vertices[part.vertices] - vertices[joint]) @ onward.T
    seen[joined] = flat[joints]
    own = np.concatenate([part.network.edges, part.network.edges[:, ::-1]])
    weights = np.zeros(len(seen))
    weights[own[joined[own[:, 0]], 1]] = 1.0
    weights[joined] = len(seen)  # a common point holds its place; the vertices next to it give the rotation
    return replace(posed, seen=seen, weights=weights / weights.sum())


def _onward(flat_ways: Floats, ways: Floats) -> Floats:
    """Return the axes in which flat directions match surface directions best.

    flat_ways: (j, 2) mm.
    ways: (j, 3) mm, along the surface.
    Returns (2, 3), unit vectors right and up.
    """
    turned, _, axes = np.linalg.svd(flat_ways.T @ ways, full_matrices=False)
    return np.asarray(turned @ axes)


def parts(network: Network) -> Iterator[Piece]:
    """Yield the edge-connected parts, the largest first.

    Each following one is the largest that touches those before it.
    """
    labels = components(_hanging(network.sides), len(network.faces))
    if not labels.any():
        yield Piece(np.arange(network.faces.max() + 1), network.faces, network)
        return
    reached = np.zeros(network.faces.max() + 1, bool)
    left = list(np.argsort(-np.bincount(labels), kind="stable"))
    while left:
        adjacent = np.unique(labels[reached[network.faces].any(axis=1)])
        label = next((label for label in left if label in adjacent), left[0])
        left.remove(label)
        piece = part_of(network, labels == label)
        reached[piece.vertices] = True
        yield piece


def _hanging(sides: Sides) -> Ints:
    """Return the pairs (k, 2) of faces with a common edge."""
    faces, same_edge = sides.at // 3, np.ones(len(sides.at), bool)
    same_edge[sides.first[:-1]] = False
    later = np.flatnonzero(same_edge)
    return np.stack([faces[later - 1], faces[later]], axis=1)
