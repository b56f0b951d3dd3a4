"""The strain of the faces of a flat page, as reports and maps show it."""

from __future__ import annotations

import numpy as np

from restore.mesh.measures import stretches
from restore.scan import Floats, Ints


def face_strain(flat: Floats, faces: Ints, edges: Ints, lengths: Floats) -> Floats:
    """(m, 2) stretch and shear of every face from its shape on the surface to its flat one.

    flat (n, 2), edges (e, 2) and lengths (e,) as for `stretches`. With σ₁ ≥ σ₂ the principal stretches, stretch is
    √(σ₁ σ₂) − 1, shear (σ₁ − σ₂) / 2.
    """
    total, difference = stretches(flat, faces, edges, lengths)
    stretch = np.sqrt(np.abs(total**2 - difference**2)) / 2.0 - 1.0
    return np.stack([stretch, difference / 2.0], axis=1)


def average_at_vertices(values: Floats, faces: Ints, count: int) -> Floats:
    """(count, k) mean of the values (m, k) of the faces at each of `count` vertices, 0 for a vertex without faces."""
    total = np.zeros((count, values.shape[1]))
    np.add.at(total, faces.ravel(), np.repeat(values, 3, axis=0))
    return total / np.maximum(np.bincount(faces.ravel(), minlength=count), 1)[:, None]
