"""Groups of neighbouring particles that move as if they were rigid.

What pulls at one end of a page and holds at the other is felt by way of a few of them, where it would take as many
passes over the sticks as there are sticks in between. Non-overlapping aggregates with their rigid-body modes as the
coarse space of a two-level preconditioner (Vaněk, Mandel & Brezina 1996, without their smoothing).
"""

from __future__ import annotations

from math import atan2, cos, floor, sin, sqrt
from typing import NamedTuple

import numba
import numpy as np

from restore.numerics import TINY
from restore.scan import Floats, Ints

GROWTH = 3 / 5  # c aggregates of n particles take c² to factorise, and √(n / c) passes of n: both grow as n^(6/5) then
MODES = 3  # right, up, and a turn
STIFFEN = 1e-6  # of the stiffness: the page as a whole has none, nor has a single particle against a turn, or across
# edges in one line


class Aggregates(NamedTuple):
    """owner (n,): the aggregate of each particle; arms (n, 2): where it lies from the middle, in units of the size.

    factor (·,): the Cholesky factor of their stiffness, by MODES rows for each, its diagonal inverted. Of row i it has
    what stands from column first[i] to the diagonal, as start[i] to start[i + 1].
    """

    owner: Ints
    arms: Floats
    first: Ints
    start: Ints
    factor: Floats


@numba.njit(cache=True)
def aggregate(flat: Floats, edges: Ints, gradients: Floats) -> Aggregates:
    """Cells of a grid over flat (n, 2) mm, numbered along its shorter side, joined by edges (e, 2).

    gradients (e, 2): of the strain of each edge when its end is moved.
    """
    owner, arms, count = _cells(flat)
    first, start = _profile(owner, edges, count)
    matrix = _stiffness(owner, arms, first, start, edges, gradients)
    _factorise(matrix, first, start)
    return Aggregates(owner, arms, first, start, matrix)


@numba.njit(cache=True)
def _cells(flat: Floats) -> tuple[Ints, Floats, int]:
    """The cell (n,) each of flat (n, 2) is in, where it lies from their middle (n, 2), and how many cells there are.

    The grid lies along the page's own axes about its centre: a page that is turned has the same cells.
    """
    along, across = _own_frame(flat)
    low_x, high_x, low_y, high_y = along.min(), along.max(), across.min(), across.max()
    wide, high = high_x - low_x, high_y - low_y
    count = len(flat) ** GROWTH
    size = max(sqrt(wide * high / count), max(wide, high) / count) + TINY
    left, low = floor(low_x / size + 0.5), floor(low_y / size + 0.5)
    columns, rows = int(floor(high_x / size + 0.5) - left) + 1, int(floor(high_y / size + 0.5) - low) + 1
    owner, number = np.empty(len(flat), np.int64), np.full(columns * rows, -1)
    for i in range(len(flat)):
        column, row = int(floor(along[i] / size + 0.5) - left), int(floor(across[i] / size + 0.5) - low)
        owner[i] = column * rows + row if rows < columns else row * columns + column
        number[owner[i]] = 0
    found = 0
    for cell in range(len(number)):
        if number[cell] == 0:
            number[cell], found = found, found + 1
    owner = number[owner]
    arms, members = np.empty_like(flat), np.bincount(owner)
    for axis in range(2):
        middle = np.bincount(owner, flat[:, axis]) / members
        arms[:, axis] = (flat[:, axis] - middle[owner]) / size
    return owner, arms, found


@numba.njit(cache=True)
def _own_frame(flat: Floats) -> tuple[Floats, Floats]:
    """Where flat (n, 2) lies along its principal axes: along the first (n,), and across (n,), from its centre."""
    x, y = flat[:, 0] - flat[:, 0].mean(), flat[:, 1] - flat[:, 1].mean()
    angle = 0.5 * atan2(2.0 * (x * y).sum(), (x * x).sum() - (y * y).sum())
    return cos(angle) * x + sin(angle) * y, cos(angle) * y - sin(angle) * x


@numba.njit(cache=True)
def _profile(owner: Ints, edges: Ints, count: int) -> tuple[Ints, Ints]:
    """First column (MODES · count,) of every row of the matrix, and where the row begins, and the last ends."""
    lowest = np.arange(count)
    for k in range(len(edges)):
        a, b = owner[edges[k, 0]], owner[edges[k, 1]]
        lowest[max(a, b)] = min(lowest[max(a, b)], a, b)
    first = np.repeat(MODES * lowest, MODES)
    start = np.zeros(len(first) + 1, np.int64)
    start[1:] = np.cumsum(np.arange(len(first)) - first + 1)
    return first, start


@numba.njit(cache=True)
def _stiffness(owner: Ints, arms: Floats, first: Ints, start: Ints, edges: Ints, gradients: Floats) -> Floats:
    """(·,) the lower half of the matrix, row by row: what the strain of an edge does to the modes of both its ends."""
    matrix, strain, row = np.zeros(start[-1]), np.empty(2 * MODES), np.empty(2 * MODES, np.int64)
    for k in range(len(edges)):
        if owner[edges[k, 0]] == owner[edges[k, 1]]:  # nothing within is strained
            continue
        for end, sign in ((0, -1.0), (1, 1.0)):
            i, x, y = edges[k, end], sign * gradients[k, 0], sign * gradients[k, 1]
            for mode, moved in enumerate((x, y, y * arms[i, 0] - x * arms[i, 1])):
                row[MODES * end + mode], strain[MODES * end + mode] = MODES * owner[i] + mode, moved
        for p in range(2 * MODES):
            for q in range(2 * MODES):
                if row[p] >= row[q]:
                    matrix[start[row[p]] + row[q] - first[row[p]]] += strain[p] * strain[q]
    return matrix


@numba.njit(cache=True, fastmath={"reassoc"})
def _factorise(matrix: Floats, first: Ints, start: Ints) -> None:
    """The Cholesky factor, in place; 0 on the diagonal for a mode that nothing holds but rounding: it does not move.

    That is told by all modes of an aggregate: particles in one line have hardly any stiffness across it, or to a turn.
    """
    least = np.zeros(len(first) // MODES)
    for i in range(len(first)):
        least[i // MODES] += STIFFEN * STIFFEN * matrix[start[i + 1] - 1]
    for i in range(len(first)):
        own = matrix[start[i] : start[i + 1]]
        own[-1] *= 1.0 + STIFFEN
        for j in range(first[i], i + 1):
            low, other = max(first[i], first[j]), matrix[start[j] : start[j + 1]]
            rest, column = own[j - first[i]], other[low - first[j] :]
            for k in range(j - low):
                rest -= own[low - first[i] + k] * column[k]
            own[j - first[i]] = rest * other[-1]
        own[-1] = 1.0 / sqrt(rest) if rest > least[i // MODES] else 0.0


@numba.njit(cache=True, fastmath={"reassoc"})
def correct_rigidly(aggregates: Aggregates, force: Floats, way: Floats) -> float:
    """Add to the way (n, 2) that of the rigid aggregates under forces (n, 2); the force along it."""
    owner, arms, first, start, factor = aggregates
    modes = np.zeros(len(first))
    for i in range(len(force)):
        mode = modes[MODES * owner[i] : MODES * owner[i] + MODES]
        mode[0] += force[i, 0]
        mode[1] += force[i, 1]
        mode[2] += force[i, 1] * arms[i, 0] - force[i, 0] * arms[i, 1]
    for i in range(len(first)):
        row, before, rest = factor[start[i] : start[i + 1]], modes[first[i] :], modes[i]
        for k in range(len(row) - 1):
            rest -= row[k] * before[k]
        modes[i] = rest * row[-1]
    work = (modes * modes).sum()
    for i in range(len(first) - 1, -1, -1):
        row, before, found = factor[start[i] : start[i + 1]], modes[first[i] :], modes[i] * factor[start[i + 1] - 1]
        for k in range(len(row) - 1):
            before[k] -= row[k] * found
        modes[i] = found
    for i in range(len(force)):
        mode = modes[MODES * owner[i] : MODES * owner[i] + MODES]
        way[i, 0] += mode[0] - mode[2] * arms[i, 1]
        way[i, 1] += mode[1] + mode[2] * arms[i, 0]
    return float(work)
