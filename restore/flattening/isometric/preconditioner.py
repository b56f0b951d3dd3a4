"""Two-level preconditioner of conjugate gradients for a page's stiffness.

Near by, an incomplete factor with entries for the edges alone: vertices are eliminated one after the other, those of
the rim first. The fill-in between their neighbours is dropped, the change of the diagonal is kept (D-ILU: Pommerell
1992). An edge resists along itself alone and can lose no more than that: no pivot is negative, however thin the faces
are. Far off, groups of neighbouring particles that move as if they were rigid: non-overlapping aggregates (Vaněk,
Mandel & Brezina 1996, without their smoothing).
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt
from typing import NamedTuple

import numba
import numpy as np

from restore.mesh.adjacency import order_of_pairs
from restore.numerics.limits import TINY, sum_in_order
from restore.scan import Floats, Ints

GROWTH = 3 / 7  # c aggregates of n particles take c³ to factorise, and √(n / c) passes of n: both grow as n^(9/7) then
MODES = 3  # right, up, and a turn
STIFFEN = 1e-8  # of the stiffness: the page as a whole has none, nor has a single particle against a turn, or across
# edges in one line


class Preconditioner(NamedTuple):
    """inverse (n, 3): xx, xy, yy of the inverse pivots of the incomplete factor.

    owner (n,): the aggregate of each particle; arms (n, 2): where it lies from the middle, in units of the size.
    factor (k, k): the Cholesky factor of their stiffness below its inverted diagonal, MODES rows for each aggregate.
    modes (k,): scratch.
    """

    inverse: Floats
    owner: Ints
    arms: Floats
    factor: Floats
    modes: Floats


def prepared(flat: Floats, edges: Ints, gradients: Floats, blocks: Floats) -> Preconditioner:
    """Prepare the preconditioner of a page.

    flat: (n, 2), with diagonal blocks (n, 3) and edges (e, 2) ordered by `rim_first`.
    gradients: (e, 2), of the strain of each edge when its end is moved.
    """
    owner, arms = _cells(flat)
    count = int(owner.max()) + 1
    factor, inverse = np.zeros((MODES * count, MODES * count)), np.empty_like(blocks)
    _add_stiffness(owner, arms, edges, gradients, factor, np.empty(2 * MODES), np.empty(2 * MODES, np.int64))
    _factorise(factor, np.zeros(count))
    _invert_pivots(edges, gradients, blocks, inverse)
    return Preconditioner(inverse, owner, arms, factor, np.empty(len(factor)))


@numba.njit(cache=True)
def precondition(by: Preconditioner, edges: Ints, gradients: Floats, force: Floats, way: Floats) -> float:
    """Write the approximate displacement (n, 2) under forces (n, 2).

    Returns the force along it.
    """
    return substitute(edges, gradients, by.inverse, force, way) + correct_rigidly(by, force, way)


def rim_first(flat: Floats, edges: Ints) -> tuple[Ints, Ints, Ints]:
    """Order vertices for elimination, and edges by the end eliminated last.

    A page that is rotated, mirrored or numbered differently has the same order.
    flat: (n, 2).
    edges: (e, 2).
    Returns the order of the vertices (n,) and of the edges (e,), and those edges with the places of their ends in it,
    the last end second.
    """
    x, y = _from_centre(flat)
    vertices = np.argsort(-(x * x + y * y), kind="stable")
    place = np.empty_like(vertices)
    place[vertices] = np.arange(len(flat))
    one, other = place[edges].T
    first, last = np.minimum(one, other), np.maximum(one, other)
    order = order_of_pairs(last, first, len(flat))
    return vertices, order, np.stack((first[order], last[order]), axis=1).astype(np.uint32)


def _from_centre(flat: Floats) -> tuple[Floats, Floats]:
    """x (n,) and y (n,) of flat (n, 2) from their mean."""
    x, y = flat.T
    return x - sum_in_order(x) / len(x), y - sum_in_order(y) / len(y)


@numba.njit(cache=True)
def _invert_pivots(edges: Ints, gradients: Floats, blocks: Floats, inverse: Floats) -> None:
    """Write (n, 3): xx, xy, yy of the inverse pivots of diagonal blocks (n, 3)."""
    k = 0
    for i in range(len(blocks)):
        xx, xy, yy = blocks[i, 0], blocks[i, 1], blocks[i, 2]
        while k < len(edges) and edges[k, 1] == i:
            a, x, y = edges[k, 0], gradients[k, 0], gradients[k, 1]
            lost = inverse[a, 0] * x * x + 2.0 * inverse[a, 1] * x * y + inverse[a, 2] * y * y
            xx, xy, yy, k = xx - lost * x * x, xy - lost * x * y, yy - lost * y * y, k + 1
        inverse_det = 1.0 / max(xx * yy - xy * xy, TINY)
        inverse[i, 0], inverse[i, 1], inverse[i, 2] = inverse_det * yy, -inverse_det * xy, inverse_det * xx


@numba.njit(cache=True)
def substitute(edges: Ints, gradients: Floats, inverse: Floats, force: Floats, way: Floats) -> float:
    """Write the displacement (n, 2) under forces by the factor's pivots.

    force: (n, 2). Returns the force along the displacement.
    """
    work, k = 0.0, 0
    for i in range(len(force)):
        x, y = force[i, 0], force[i, 1]
        while k < len(edges) and edges[k, 1] == i:
            pull = gradients[k, 0] * way[edges[k, 0], 0] + gradients[k, 1] * way[edges[k, 0], 1]
            x, y, k = x + pull * gradients[k, 0], y + pull * gradients[k, 1], k + 1
        way[i, 0], way[i, 1] = inverse[i, 0] * x + inverse[i, 1] * y, inverse[i, 1] * x + inverse[i, 2] * y
        work += x * way[i, 0] + y * way[i, 1]
    for k in range(len(edges) - 1, -1, -1):
        a, i, x, y = edges[k, 0], edges[k, 1], gradients[k, 0], gradients[k, 1]
        pull = x * way[i, 0] + y * way[i, 1]
        way[a, 0] += pull * (inverse[a, 0] * x + inverse[a, 1] * y)
        way[a, 1] += pull * (inverse[a, 1] * x + inverse[a, 2] * y)
    return work


def _cells(flat: Floats) -> tuple[Ints, Floats]:
    """Assign vertices to the cells of a grid.

    The grid lies along the page's principal axes about its centre: a page that is rotated has the same cells.
    flat: (n, 2).
    Returns the cell (n,), and the position (n, 2) relative to the cell's centre.
    """
    x, y = _from_centre(flat)
    angle = 0.5 * atan2(2.0 * sum_in_order(x * y), sum_in_order(x * x) - sum_in_order(y * y))
    along, across = cos(angle) * x + sin(angle) * y, cos(angle) * y - sin(angle) * x
    wide, high, count = float(np.ptp(along)), float(np.ptp(across)), len(flat) ** GROWTH
    size = max(sqrt(wide * high / count), max(wide, high) / count) + TINY
    columns, rows = np.floor(along / size + 0.5), np.floor(across / size + 0.5)
    owner = ((columns - columns.min()) * (np.ptp(rows) + 1.0) + rows - rows.min()).astype(np.int64)
    members = np.bincount(owner)
    owner = (np.cumsum(members > 0) - 1)[owner]  # cells without a particle have no number
    members = members[members > 0]
    middles = (np.bincount(owner, places) / members for places in flat.T)
    return owner, np.stack([(p - middle[owner]) / size for p, middle in zip(flat.T, middles, strict=True)], axis=1)


@numba.njit(cache=True)
def _add_stiffness(
    owner: Ints, arms: Floats, edges: Ints, gradients: Floats, matrix: Floats, strain: Floats, row: Ints
) -> None:
    """Add the effect of an edge's strain on the modes of both its ends.

    matrix: (k, k).
    strain, row: (2 · MODES,), scratch.
    """
    for k in range(len(edges)):
        if owner[edges[k, 0]] == owner[edges[k, 1]]:  # nothing within is strained
            continue
        for end in range(2):
            i, sign = edges[k, end], 2.0 * end - 1.0
            x, y, first = sign * gradients[k, 0], sign * gradients[k, 1], MODES * end
            strain[first], strain[first + 1], strain[first + 2] = x, y, y * arms[i, 0] - x * arms[i, 1]
            for mode in range(MODES):
                row[first + mode] = MODES * owner[i] + mode
        for p in range(2 * MODES):
            for q in range(2 * MODES):
                matrix[row[p], row[q]] += strain[p] * strain[q]


@numba.njit(cache=True, fastmath={"reassoc"})
def _factorise(matrix: Floats, least: Floats) -> None:
    """Factorise by Cholesky in place; 0 on the diagonal of a free mode.

    A mode that nothing but rounding holds does not move. All modes of an aggregate decide that: particles in one line
    have hardly any stiffness across it, or against a rotation.
    least: (k,) zeros, scratch, one for each aggregate.
    """
    for i in range(len(matrix)):
        least[i // MODES] += STIFFEN * STIFFEN * matrix[i, i]
        matrix[i, i] *= 1.0 + STIFFEN
    for i in range(len(matrix)):
        own = matrix[i]
        for j in range(i + 1):
            rest, other = own[j], matrix[j]
            for k in range(j):
                rest -= own[k] * other[k]
            own[j] = rest * other[j]
        matrix[i, i] = 1.0 / sqrt(rest) if rest > least[i // MODES] else 0.0


@numba.njit(cache=True, fastmath={"reassoc"})
def correct_rigidly(by: Preconditioner, force: Floats, way: Floats) -> float:
    """Add the displacement (n, 2) of the rigid aggregates under forces.

    force: (n, 2). Returns the force along it.
    """
    owner, arms, factor, modes = by.owner, by.arms, by.factor, by.modes
    for i in range(len(modes)):
        modes[i] = 0.0
    for i in range(len(force)):
        first = MODES * owner[i]
        modes[first] += force[i, 0]
        modes[first + 1] += force[i, 1]
        modes[first + 2] += force[i, 1] * arms[i, 0] - force[i, 0] * arms[i, 1]
    for i in range(len(modes)):
        rest, row = modes[i], factor[i]
        for k in range(i):
            rest -= row[k] * modes[k]
        modes[i] = rest * row[i]
    work = 0.0
    for i in range(len(modes)):
        work += modes[i] * modes[i]
    for i in range(len(modes) - 1, -1, -1):
        row, found = factor[i], factor[i, i] * modes[i]
        for k in range(i):
            modes[k] -= row[k] * found
        modes[i] = found
    for i in range(len(force)):
        first = MODES * owner[i]
        way[i, 0] += modes[first] - modes[first + 2] * arms[i, 1]
        way[i, 1] += modes[first + 1] + modes[first + 2] * arms[i, 0]
    return work
