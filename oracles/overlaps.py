"""Triangles that lie over each other: every pair of a flat mesh tried, none missed between pixels."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from restore.scan import Floats, Ints

DEEP_MM = 1e-6  # neighbours touch along their common edge, to rounding


def overlapping_pairs(flat: Floats, faces: Ints) -> Ints:
    """(k, 2): the pairs of faces (m, 3) over flat (n, 2) mm whose insides meet, by the separating axis theorem.

    Two triangles are apart exactly when one of their six edges has them on either side. Triangles that share a corner
    or an edge are judged like all others.
    """
    corners = flat[faces]
    pairs = _near(corners)
    one, other = corners[pairs[:, 0]], corners[pairs[:, 1]]
    depth = np.minimum(_least_depth(one, other), _least_depth(other, one))
    return pairs[depth > DEEP_MM]


def _near(corners: Floats) -> Ints:
    """The pairs of triangles (m, 3, 2) whose circles about their middle meet, small ones with small."""
    centres = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    tree, found = cKDTree(centres), []
    # Each triangle looks for those no larger than itself, of which none is farther than twice its own reach.
    for i, near in enumerate(tree.query_ball_point(centres, 2 * reach)):
        j = np.asarray(near)
        j = j[(reach[j] < reach[i]) | ((reach[j] == reach[i]) & (j < i))]
        found.append(np.stack([np.full(len(j), i), j], axis=1))
    return np.concatenate(found)


def _least_depth(one: Floats, other: Floats) -> Floats:
    """(k,) mm: how deep the triangles reach into each other across that edge of `one` where they do so least."""
    edge = np.roll(one, -1, axis=1) - one
    normal = np.stack([-edge[..., 1], edge[..., 0]], axis=-1)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), np.finfo(float).tiny)
    mine, theirs = (np.einsum("kei,kvi->kev", normal, corners) for corners in (one, other))
    depth = np.minimum(mine.max(axis=2), theirs.max(axis=2)) - np.maximum(mine.min(axis=2), theirs.min(axis=2))
    return np.asarray(depth.min(axis=1))
