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

PARTICLES = 40  # in one of them: with half as many, passes are a third fewer and cost twice as much
MOST = 2000  # of them: to factorise their stiffness takes as long as the passes that it saves
MODES = 3  # right, up, and a turn
STIFFEN = 1e-6  # of the stiffness: the page as a whole has none, nor has a single particle against a turn, or across
# edges in one line


class Aggregates(NamedTuple):
    """owner (n,): the aggregate of each particle; arms (n, 2): where it lies from the middle, in units of the size.

    blocks (·, 3, 3): their stiffness as a symmetric matrix of blocks, one for each pair of them, factorised by
    Cholesky's method, those of the diagonal inverted. Only the lower half is kept: of row i what stands from column
    first[i] to the diagonal, as blocks start[i] to start[i + 1].
    """

    owner: Ints
    arms: Floats
    first: Ints
    start: Ints
    blocks: Floats


@numba.njit(cache=True)
def aggregate(flat: Floats, edges: Ints, gradients: Floats) -> Aggregates:
    """Cells of a grid over flat (n, 2) mm, numbered along its shorter side, joined by edges (e, 2).

    gradients (e, 2): of the strain of each edge when its end is moved.
    """
    owner, arms, count = _cells(flat)
    first, start = _profile(owner, edges, count)
    blocks = _stiffness(owner, arms, first, start, edges, gradients)
    _factorise(blocks, first, start)
    return Aggregates(owner, arms, first, start, blocks)


@numba.njit(cache=True)
def _cells(flat: Floats) -> tuple[Ints, Floats, int]:
    """The cell (n,) each of flat (n, 2) is in, where it lies from their middle (n, 2), and how many cells there are.

    The grid lies along the page's own axes about its centre: a page that is turned has the same cells.
    """
    along, across = _own_frame(flat)
    low_x, high_x, low_y, high_y = along.min(), along.max(), across.min(), across.max()
    wide, high = high_x - low_x, high_y - low_y
    count = min(max(len(flat) // PARTICLES, 1), MOST)
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
    middle, members = np.zeros((found, 2)), np.zeros(found)
    for i in range(len(flat)):
        owner[i] = number[owner[i]]
        members[owner[i]] += 1.0
        for axis in range(2):
            middle[owner[i], axis] += flat[i, axis]
    arms = np.empty_like(flat)
    for i in range(len(flat)):
        for axis in range(2):
            arms[i, axis] = (flat[i, axis] - middle[owner[i], axis] / members[owner[i]]) / size
    return owner, arms, found


@numba.njit(cache=True)
def _own_frame(flat: Floats) -> tuple[Floats, Floats]:
    """Where flat (n, 2) lies along its principal axes: along the first (n,), and across (n,), from its centre."""
    x, y = flat[:, 0] - flat[:, 0].mean(), flat[:, 1] - flat[:, 1].mean()
    angle = 0.5 * atan2(2.0 * (x * y).sum(), (x * x).sum() - (y * y).sum())
    return cos(angle) * x + sin(angle) * y, cos(angle) * y - sin(angle) * x


@numba.njit(cache=True)
def _profile(owner: Ints, edges: Ints, count: int) -> tuple[Ints, Ints]:
    """First column (count,) of every row of the matrix, and where the row begins (count + 1,)."""
    first, start = np.arange(count), np.zeros(count + 1, np.int64)
    for k in range(len(edges)):
        a, b = owner[edges[k, 0]], owner[edges[k, 1]]
        first[max(a, b)] = min(first[max(a, b)], a, b)
    for i in range(count):
        start[i + 1] = start[i] + i - first[i] + 1
    return first, start


@numba.njit(cache=True)
def _stiffness(owner: Ints, arms: Floats, first: Ints, start: Ints, edges: Ints, gradients: Floats) -> Floats:
    """(·, 3, 3) the blocks before they are factorised."""
    blocks, moved = np.zeros((start[-1], MODES, MODES)), np.empty((2, MODES))
    for k in range(len(edges)):
        a, b = owner[edges[k, 0]], owner[edges[k, 1]]
        if a == b:  # nothing within is strained
            continue
        x, y = gradients[k, 0], gradients[k, 1]
        for end in range(2):
            i = edges[k, end]
            moved[end, 0], moved[end, 1], moved[end, 2] = x, y, y * arms[i, 0] - x * arms[i, 1]
        _add(blocks[start[a + 1] - 1], moved[0], moved[0], 1.0)
        _add(blocks[start[b + 1] - 1], moved[1], moved[1], 1.0)
        if a > b:
            _add(blocks[start[a] + b - first[a]], moved[0], moved[1], -1.0)
        else:
            _add(blocks[start[b] + a - first[b]], moved[1], moved[0], -1.0)
    return blocks


@numba.njit(cache=True)
def _factorise(blocks: Floats, first: Ints, start: Ints) -> None:
    for i in range(len(first)):
        for j in range(first[i], i + 1):
            block = blocks[start[i] + j - first[i]]
            if i == j:
                for p in range(MODES):
                    block[p, p] += STIFFEN * block[p, p]
            for k in range(max(first[i], first[j]), j):
                _subtract(block, blocks[start[i] + k - first[i]], blocks[start[j] + k - first[j]])
            if j < i:
                _divide(block, blocks[start[j + 1] - 1])
            else:
                _invert(block)


@numba.njit(cache=True)
def _add(block: Floats, left: Floats, right: Floats, sign: float) -> None:
    for p in range(MODES):
        for q in range(MODES):
            block[p, q] += sign * left[p] * right[q]


@numba.njit(cache=True)
def _subtract(block: Floats, left: Floats, right: Floats) -> None:
    """block − left · rightᵀ."""
    for p in range(MODES):
        for q in range(MODES):
            block[p, q] -= left[p, 0] * right[q, 0] + left[p, 1] * right[q, 1] + left[p, 2] * right[q, 2]


@numba.njit(cache=True)
def _divide(block: Floats, inverse: Floats) -> None:
    """block · inverseᵀ, inverse lower triangular."""
    for p in range(MODES):
        x, y, z = block[p, 0], block[p, 1], block[p, 2]
        block[p, 0] = inverse[0, 0] * x
        block[p, 1] = inverse[1, 0] * x + inverse[1, 1] * y
        block[p, 2] = inverse[2, 0] * x + inverse[2, 1] * y + inverse[2, 2] * z


@numba.njit(cache=True)
def _invert(block: Floats) -> None:
    """The inverse of the lower triangle L of block = L · Lᵀ; 0 for a mode that nothing holds: it does not move."""
    least = STIFFEN * STIFFEN * (block[0, 0] + block[1, 1] + block[2, 2])
    a = _inverse_root(block[0, 0], least)
    b, c = block[1, 0] * a, block[2, 0] * a
    d = _inverse_root(block[1, 1] - b * b, least)
    e = (block[2, 1] - b * c) * d
    f = _inverse_root(block[2, 2] - c * c - e * e, least)
    block[0, 0], block[1, 1], block[2, 2] = a, d, f
    block[1, 0], block[2, 1], block[2, 0] = -b * a * d, -e * d * f, (b * e * d - c) * a * f
    block[0, 1], block[0, 2], block[1, 2] = 0.0, 0.0, 0.0


@numba.njit(cache=True)
def _inverse_root(pivot: float, least: float) -> float:
    return 1.0 / sqrt(pivot) if pivot > least else 0.0


@numba.njit(cache=True)
def correct_rigidly(aggregates: Aggregates, force: Floats, way: Floats) -> float:
    """Add to the way (n, 2) that of the rigid aggregates under forces (n, 2); the force along it."""
    owner, arms, first, start, blocks = aggregates
    modes = np.zeros((len(first), MODES))
    for i in range(len(force)):
        mode = modes[owner[i]]
        mode[0] += force[i, 0]
        mode[1] += force[i, 1]
        mode[2] += force[i, 1] * arms[i, 0] - force[i, 0] * arms[i, 1]
    for i in range(len(first)):
        x, y, z = modes[i]
        for k in range(first[i], i):
            block, mode = blocks[start[i] + k - first[i]], modes[k]
            x -= block[0, 0] * mode[0] + block[0, 1] * mode[1] + block[0, 2] * mode[2]
            y -= block[1, 0] * mode[0] + block[1, 1] * mode[1] + block[1, 2] * mode[2]
            z -= block[2, 0] * mode[0] + block[2, 1] * mode[1] + block[2, 2] * mode[2]
        own = blocks[start[i + 1] - 1]
        modes[i, 0] = own[0, 0] * x
        modes[i, 1] = own[1, 0] * x + own[1, 1] * y
        modes[i, 2] = own[2, 0] * x + own[2, 1] * y + own[2, 2] * z
    work = (modes * modes).sum()
    for i in range(len(first) - 1, -1, -1):
        own, (x, y, z) = blocks[start[i + 1] - 1], modes[i]
        x = own[0, 0] * x + own[1, 0] * y + own[2, 0] * z
        y = own[1, 1] * y + own[2, 1] * z
        z = own[2, 2] * z
        modes[i, 0], modes[i, 1], modes[i, 2] = x, y, z
        for k in range(first[i], i):
            block, mode = blocks[start[i] + k - first[i]], modes[k]
            for q in range(MODES):
                mode[q] -= block[0, q] * x + block[1, q] * y + block[2, q] * z
    for i in range(len(force)):
        mode = modes[owner[i]]
        way[i, 0] += mode[0] - mode[2] * arms[i, 1]
        way[i, 1] += mode[1] + mode[2] * arms[i, 0]
    return work
