"""Corrects vertices that decimation has moved off the surface.

Quadric error metrics put a vertex where the planes of the faces that it stands for meet best (Garland & Heckbert,
"Surface simplification using quadric error metrics", 1997): on the outside of a bend. Lengths through such vertices are
those of a wider surface. The only evidence of the distance is that neighbours stand off by different amounts, as their
own faces are larger or smaller.
"""

from __future__ import annotations

from math import pi, sqrt

import numba
import numpy as np

from restore.mesh.jets import Jets
from restore.numerics.limits import TINY
from restore.numerics.robust import robust_sigma
from restore.scan import Floats, Ints

# Of the mean height of its neighbours over the tangent plane: the mean square of the distance from the centre to a
# regular hexagon, over that to its neighbours. The mean height of what a vertex stands for is where its planes meet.
OUTSIDE = 5.0 / 36.0


def correct_decimation_bias(vertices: Floats, jets: Jets, edges: Ints, chosen: Ints) -> Floats:
    """Return vertices moved back from where decimation has put them.

    vertices: (n, 3) mm.
    chosen: (k,), the ones to move, if quadric error metrics have placed them.
    Returns (n, 3) mm.
    """
    points = vertices.copy()
    heights = OUTSIDE * _neighbour_heights(vertices, jets.forms, edges)
    points[chosen] += heights[chosen, None] * jets.normals[chosen]
    return points


@numba.njit(cache=True)
def _neighbour_heights(vertices: Floats, forms: Floats, edges: Ints) -> Floats:
    """Return the mean height of the neighbours over each tangent plane.

    vertices: (n, 3) mm.
    forms: (n, 3, 3), that predict it.
    Returns (n,) mm.
    """
    heights, counts = np.zeros(len(vertices)), np.zeros(len(vertices))
    for k in range(len(edges)):
        a, b = edges[k, 0], edges[k, 1]
        for end in (a, b):
            counts[end] += 1.0
            for p in range(3):
                for q in range(3):
                    product = (vertices[b, p] - vertices[a, p]) * (vertices[b, q] - vertices[a, q])
                    heights[end] += 0.5 * forms[end, p, q] * product
    return heights / np.maximum(counts, 1.0)


def stood_outside(offsets: Floats, shifts: Floats) -> bool:
    """Return whether patch offsets show vertices outside the surface.

    The fraction of the shifts which leaves the least absolute offsets is 0 for vertices on the surface and 1 outside:
    it must be nearer to 1, and the two be five of its standard errors apart, because neighbouring patches have points
    in common. Every vertex has a patch.
    offsets: (k,) mm, of patches from their vertices.
    shifts: (k,) mm, change of the offsets when the vertices are moved back.
    """
    moved = np.abs(shifts) > TINY
    if not moved.any():
        return False
    ratios = -offsets[moved] / shifts[moved]
    order = np.argsort(ratios)
    weights = np.cumsum(np.abs(shifts[moved])[order])
    ratio = float(ratios[order][np.searchsorted(weights, 0.5 * weights[-1])])
    spread = sqrt(0.5 * pi) * robust_sigma(offsets + ratio * shifts)  # of a median, over that of a mean
    return abs(ratio - 1.0) < 0.5 and 5.0 * spread < float(np.linalg.norm(shifts))
