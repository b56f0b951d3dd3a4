"""Facets of a relief, prolonged to the creases between them.

No patch that straddles a crease is measured, so a relief through the points cuts its creases off by some millimetres. A
facet is a connected part without a bend; beyond its last points it continues as it is, and each place next to a crease
lies on the facet that comes nearest to the relief there: of those that meet at a ridge that is the lower one. Towards
the edge of the page only those facets continue that reach it.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from restore.numerics.robust import SIGNIFICANT
from restore.photogrammetry.surfaces.lattice import BENDING, CREASE_BEND, Lattice
from restore.scan import Floats, Ints, Mask

NEAR = 1.2  # steps of the lattice from a point: its height is measured there
SHARPEST = 0.03  # 1/mm: paper that bends more is at a crease
MIN_CELLS = 30  # of a facet: 7 mm square on A4
MIN_POINTS = 20
MAX_CUT_MM = 8.0  # by which a relief cuts off the crease before a blank margin; a facet farther off is another one
FAR_MM = 25.0  # from its points that a facet is prolonged: a margin
GAP_MM = 4.0  # from the points of a facet to a crease in print; beyond is margin, whose edge has to be met
STIFF = BENDING * CREASE_BEND / 0.01  # of the bends of a facet: one of a bend of 0.01 1/mm weighs as a crease does
STAGES = ((2.0, 3),)


def prolonged(lattice: Lattice, heights: Floats, feet: Floats, above: Floats, of_facets: Mask, noise: Floats) -> Floats:
    """Return heights with those far from all points taken from facets.

    The facets next to them are prolonged.
    heights: (rows, cols).
    feet, above: (n, 2) and (n,) mm, the points that the heights were fitted to.
    of_facets: (n,), those that belong to facets.
    Returns (rows, cols) mm.
    """
    measured = _near(lattice, feet)
    rim, height, tolerance = feet[~of_facets], above[~of_facets], SIGNIFICANT * noise[~of_facets]
    to_rim, next_on_rim = cKDTree(rim).query(lattice.places) if len(rim) else (np.full(heights.shape, np.inf), None)
    feet, above, noise = feet[of_facets], above[of_facets], noise[of_facets]
    labels, normals = find_facets(lattice, heights, _near(lattice, feet))
    cell = np.clip(((feet - lattice.low) / lattice.step).astype(int), 0, np.array(labels.shape)[::-1] - 1)
    of_point = labels[cell[:, 1], cell[:, 0]]
    out, least = heights.copy(), np.where(measured, 0.0, MAX_CUT_MM)
    for label in range(labels.max() + 1):
        own = of_point == label
        if own.sum() < MIN_POINTS:
            continue
        part, at = lattice.part(feet[own].min(axis=0) - FAR_MM, feet[own].max(axis=0) + FAR_MM)
        normal = normals[labels == label].mean(axis=0)
        normal /= np.linalg.norm(normal)
        found = part.fitted(feet[own], above[own], STAGES, weight=STIFF, normal=normal, noise=noise[own])
        off = np.abs(found - heights[at])
        away = cKDTree(feet[own]).query(part.places)[0]
        off[away > FAR_MM] = np.inf
        if next_on_rim is not None:
            missed = np.abs(part.heights_at(found, rim) - height) > tolerance
            off[(np.minimum(to_rim[at], GAP_MM) < away) & (to_rim[at] < FAR_MM) & missed[next_on_rim[at]]] = np.inf
        nearer = off < least[at]
        least[at][nearer], out[at][nearer] = off[nearer], found[nearer]
    return out


def _near(lattice: Lattice, feet: Floats) -> Mask:
    """Return the nodes (rows, cols) that have a place next to them.

    feet: (n, 2) mm, the places.
    """
    return np.asarray(cKDTree(feet).query(lattice.places)[0] < NEAR * lattice.step)


def find_facets(lattice: Lattice, heights: Floats, measured: Mask) -> tuple[Ints, Floats]:
    """Find the facet that each cell lies on, and the normals of the cells.

    measured: (rows, cols), the nodes that points determine.
    Returns (rows − 1, cols − 1), −1 for none, and normals (…, 3).
    """
    points = lattice.raised(heights)
    normals = np.cross(points[:-1, 1:] - points[:-1, :-1], points[1:, :-1] - points[:-1, :-1])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    known = measured[:-1, :-1] & measured[1:, :-1] & measured[:-1, 1:] & measured[1:, 1:]
    number = np.arange(known.size).reshape(known.shape)
    links = np.concatenate([_links(number, normals, known, SHARPEST * lattice.step, axis) for axis in (0, 1)])
    graph = coo_matrix((np.ones(len(links)), (links[:, 0], links[:, 1])), (known.size, known.size))
    _, group = connected_components(graph, directed=False)
    large = np.bincount(group) >= MIN_CELLS
    return np.where(large, np.cumsum(large) - 1, -1)[group].reshape(known.shape), normals


def _links(number: Ints, normals: Floats, known: Mask, most: float, axis: int) -> Ints:
    """Return the neighbours (k, 2) along an axis with similar normals.

    They differ by less than `most`.
    """
    one, other = (np.delete(number, end, axis) for end in (-1, 0))
    flat, facing = known.ravel(), normals.reshape(-1, 3)
    joined = flat[one] & flat[other] & (np.linalg.norm(facing[one] - facing[other], axis=2) < most)
    return np.stack([one[joined], other[joined]], axis=1)
