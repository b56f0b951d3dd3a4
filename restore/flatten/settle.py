"""Bring a page that lies nearly right to the least strain there is."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix, identity
from scipy.sparse.linalg import splu

from restore.scan import Floats, Ints

ITERATIONS = 2  # Newton's steps; the third moves no node by a hundredth of a millimetre
ANCHOR = 1e-9  # ties the page down against drifting and turning, too weak to stretch it
TINY = 1e-9  # of an edge's length: two vertices at one place have no direction, and must not divide by zero


def settle(flat: Floats, edges: Ints, lengths: Floats, iterations: int = ITERATIONS) -> Floats:
    """Flat positions (n, 2) mm of least strain: Gauss-Newton on Σ (length / rest length − 1)² over edges (e, 2)."""
    count = len(edges)
    rows = np.repeat(np.arange(count), 4)
    columns = np.stack([2 * edges[:, 0], 2 * edges[:, 0] + 1, 2 * edges[:, 1], 2 * edges[:, 1] + 1], axis=1).ravel()
    for _ in range(iterations):
        along = flat[edges[:, 1]] - flat[edges[:, 0]]
        distance = np.maximum(np.linalg.norm(along, axis=1), TINY * lengths)
        gradient = along / (distance * lengths)[:, None]
        jacobian = csc_matrix((np.hstack([-gradient, gradient]).ravel(), (rows, columns)), (count, flat.size))
        normal = (jacobian.T @ jacobian + ANCHOR * identity(flat.size)).tocsc()
        # Symmetric and positive definite: no pivoting is needed, and the ordering may keep the symmetry.
        solver = splu(normal, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        flat = flat - solver.solve(jacobian.T @ (distance / lengths - 1.0)).reshape(-1, 2)
    return flat
