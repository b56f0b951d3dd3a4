"""The strain of the faces of a flat page, as reports and maps show it."""

from __future__ import annotations

import numpy as np

from restore.mesh.measures import edge_strain, face_shapes, lengths_between
from restore.numerics.limits import TINY
from restore.scan import Floats, Ints

MAX_CELLS = 20  # of the longer side of a page
EDGES = 100  # of a square cell, in the mean: what a few of them have wrong does not count
MIN_STRAIN_HEIGHT_RATIO = 0.05  # of the base: across thinner faces the strain is not determined
LOOSE = 1e-3  # of the weight of a cell: holds the strain near zero in a direction that too few of its edges determine


def face_strain(flat: Floats, faces: Ints, edges: Ints, lengths: Floats) -> Floats:
    """Compute stretch and shear of every face from surface to page.

    With σ₁ ≥ σ₂ the principal stretches, stretch is √(σ₁ σ₂) − 1, shear (σ₁ − σ₂) / 2. Lengths that no triangle has are
    those of a flat one on its longest side, whatever corner the face names first.
    flat, edges, lengths: (n, 2), (e, 2) and (e,), as for `stretches`.
    Returns (m, 2).
    """
    sides = [lengths_between(faces[:, k], faces[:, (k + 1) % 3], edges, lengths) for k in range(3)]
    order = (np.argmax(sides, axis=0)[:, None] + np.arange(3)) % 3
    total, difference = stretches(flat, np.take_along_axis(faces, order, axis=1), edges, lengths)
    stretch = np.sqrt(np.abs(total**2 - difference**2)) / 2.0 - 1.0
    return np.stack([stretch, difference / 2.0], axis=1)


def stretches(flat: Floats, faces: Ints, edges: Ints, lengths: Floats) -> tuple[Floats, Floats]:
    """Compute sum and difference of the principal stretches of every face.

    flat: (n, 2) mm, the shape on the page.
    edges: (e, 2), in ascending order.
    lengths: (e,) mm, the shape on the surface.
    Returns σ₁ + σ₂ and σ₁ − σ₂, (m,) each.
    """
    base, along, height = face_shapes(faces, edges, lengths, MIN_STRAIN_HEIGHT_RATIO)
    first, second = (flat[faces[:, k]] - flat[faces[:, 0]] for k in (1, 2))
    right = first / base[:, None]
    up = (second - along[:, None] * right) / height[:, None]
    # The map from the surface to the page has the columns right and up.
    total = np.hypot(right[:, 0] + up[:, 1], right[:, 1] - up[:, 0])
    difference = np.hypot(right[:, 0] - up[:, 1], right[:, 1] + up[:, 0])
    return total, difference


def average_at_vertices(values: Floats, faces: Ints, count: int) -> Floats:
    """Average values (m, k) of the faces at each of `count` vertices.

    Returns (count, k), 0 for a vertex without faces.
    """
    total = np.zeros((count, values.shape[1]))
    np.add.at(total, faces.ravel(), np.repeat(values, 3, axis=0))
    return total / np.maximum(np.bincount(faces.ravel(), minlength=count), 1)[:, None]


def smooth_rms_strain(flat: Floats, edges: Ints, lengths: Floats) -> float:
    """Return the rms strain of whole cells of the page over all directions.

    A length that is wrong, as over a crease or in noise, strains its own edge, and hardly its cell; a surface that is
    not developable strains all edges of a cell alike.
    flat: (n, 2).
    edges: (e, 2), of lengths (e,) mm.
    """
    ways = flat[edges[:, 1]] - flat[edges[:, 0]]
    apart = np.hypot(*ways.T)
    x, y = ways.T / np.maximum(apart, TINY)
    every = 0.5 * (apart == 0.0)  # an edge that has collapsed is as short in every direction
    terms = x**2 + every, 2.0 * x * y, y**2 + every  # of a symmetric tensor
    cell = _cells(flat, edges)
    weights = lengths**2  # as the area that an edge stands for
    of_cells, strain = np.bincount(cell, weights), edge_strain(flat, edges, lengths)
    right = np.stack([np.bincount(cell, weights * strain * term) for term in terms], axis=1)
    products = [np.bincount(cell, weights * one * other) for one in terms for other in terms]
    gram = np.stack(products, axis=1).reshape(-1, 3, 3) + LOOSE * of_cells[:, None, None] * np.eye(3)
    xx, xy, yy = np.linalg.solve(gram, right[..., None])[..., 0].T
    squares = (3.0 * xx**2 + 3.0 * yy**2 + 2.0 * xx * yy + 4.0 * xy**2) / 8.0  # mean over all directions
    return float(np.sqrt(np.average(squares, weights=of_cells)))


def _cells(flat: Floats, edges: Ints) -> Ints:
    """Return the square cell (e,) of the page with each edge's midpoint.

    Cells without an edge have no number.
    """
    low, count = flat.min(axis=0), min(max(round(np.sqrt(len(edges) / EDGES)), 1), MAX_CELLS)
    size = float(np.ptp(flat, axis=0).max()) / count + TINY
    across, up = np.floor((flat[edges].mean(axis=1) - low) / size).astype(int).T
    return np.unique(across * (count + 1) + up, return_inverse=True)[1]
