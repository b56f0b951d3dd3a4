"""Bring a page that lies nearly right to the least strain there is.

Newton's steps on the sum of squared strains (Gauss-Newton). The linear system of each is the page's own stiffness; it
is never built: conjugate gradients (Hestenes & Stiefel 1952) need no more of it than what the sticks pull when the
particles are pushed, which is one pass over the sticks. A factorisation of it costs ten times as much at a thousand
points and a gigabyte at a hundred thousand.
"""

from __future__ import annotations

from math import sqrt

import numba
import numpy as np

from restore.flatten.kernels import SMALL
from restore.flatten.network import spread
from restore.scan import Floats, Ints

ITERATIONS = 2  # Newton's steps; the third moves no node by a hundredth of a millimetre
FIRST, REST = 1e-2, 3e-3  # of the imbalance may be left by a step: more in the first, which the second goes over again
MOST_PASSES = 1000  # over the sticks in a step: a page of 50,000 points needs half
STIFFEN = 1e-6  # of a particle's stiffness: one whose sticks lie in one line has none across it
TINY = 1e-300  # keeps zero over zero finite


def settle(flat: Floats, edges: Ints, lengths: Floats, iterations: int = ITERATIONS) -> Floats:
    """Flat positions (n, 2) mm of least strain: Gauss-Newton on Σ (length / rest length − 1)² over edges (e, 2)."""
    flat = flat.copy()
    descend(flat, *spread(edges, lengths), iterations)
    return flat


def descend(flat: Floats, edges: Ints, lengths: Floats, iterations: int) -> None:
    """As `settle`, flat (n, 2) mm in place, the edges gone over in the order given."""
    for iteration in range(iterations):
        newton_step(flat, edges, lengths, REST if iteration else FIRST, MOST_PASSES)


@numba.njit(cache=True)
def newton_step(flat: Floats, edges: Ints, lengths: Floats, left: float, passes: int) -> int:
    """Move flat (n, 2), in place, to where the sticks would be balanced were they linear; the passes taken.

    left is the share of the imbalance to stop at, in the norm of the preconditioner: each particle's own stiffness.
    """
    gradients, force, inverse = _linearised(flat, edges, lengths)
    step, push, pulled = np.zeros_like(flat), np.zeros_like(flat), np.empty_like(flat)
    now, taken = _precondition(force, inverse, pulled), 0
    wanted, before = left * left * now, np.inf
    while now > wanted and taken < passes:
        carried = now / before
        for i in range(len(flat)):
            for axis in range(2):
                push[i, axis] = pulled[i, axis] + carried * push[i, axis]
        stiffness = _pull(push, gradients, edges, pulled)
        along = now / max(stiffness, TINY)
        for i in range(len(flat)):
            for axis in range(2):
                step[i, axis] += along * push[i, axis]
                force[i, axis] -= along * pulled[i, axis]
        before, now = now, _precondition(force, inverse, pulled)
        taken += 1
    flat += step
    return taken


@numba.njit(cache=True)
def _linearised(flat: Floats, edges: Ints, lengths: Floats) -> tuple[Floats, Floats, Floats]:
    """Gradients (e, 2) of the strains, forces (n, 2) of the sticks, inverse stiffness (n, 3) of each: xx, xy, yy."""
    gradients, force, inverse = np.empty((len(edges), 2)), np.zeros_like(flat), np.zeros((len(flat), 3))
    for k in range(len(edges)):
        a, b = edges[k, 0], edges[k, 1]
        x, y = flat[b, 0] - flat[a, 0], flat[b, 1] - flat[a, 1]
        distance = sqrt(x * x + y * y) + SMALL
        x, y = x / (distance * lengths[k]), y / (distance * lengths[k])
        gradients[k, 0], gradients[k, 1] = x, y
        slack = 1.0 - distance / lengths[k]
        force[a, 0] -= slack * x
        force[a, 1] -= slack * y
        force[b, 0] += slack * x
        force[b, 1] += slack * y
        for i in (a, b):
            inverse[i, 0] += x * x
            inverse[i, 1] += x * y
            inverse[i, 2] += y * y
    for i in range(len(flat)):
        more = STIFFEN * (inverse[i, 0] + inverse[i, 2]) + TINY
        xx, xy, yy = inverse[i, 0] + more, inverse[i, 1], inverse[i, 2] + more
        inverse[i, 0], inverse[i, 1], inverse[i, 2] = yy, -xy, xx
        inverse[i] /= max(xx * yy - xy * xy, TINY)
    return gradients, force, inverse


@numba.njit(cache=True)
def _precondition(force: Floats, inverse: Floats, way: Floats) -> float:
    """Write the way (n, 2) that every particle would go alone; the force along it."""
    total = 0.0
    for i in range(len(force)):
        way[i, 0] = inverse[i, 0] * force[i, 0] + inverse[i, 1] * force[i, 1]
        way[i, 1] = inverse[i, 1] * force[i, 0] + inverse[i, 2] * force[i, 1]
        total += force[i, 0] * way[i, 0] + force[i, 1] * way[i, 1]
    return total


@numba.njit(cache=True)
def _pull(push: Floats, gradients: Floats, edges: Ints, pulled: Floats) -> float:
    """Write what the sticks pull (n, 2) when the particles are pushed (n, 2); the work it takes."""
    pulled[:] = 0.0
    work = 0.0
    for k in range(len(edges)):
        a, b = edges[k, 0], edges[k, 1]
        x, y = gradients[k, 0], gradients[k, 1]
        strain = x * (push[b, 0] - push[a, 0]) + y * (push[b, 1] - push[a, 1])
        work += strain * strain
        pulled[a, 0] -= strain * x
        pulled[a, 1] -= strain * y
        pulled[b, 0] += strain * x
        pulled[b, 1] += strain * y
    return work
