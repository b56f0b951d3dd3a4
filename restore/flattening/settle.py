"""Bring a page that lies nearly right to the least strain there is.

Newton's steps on the sum of squared strains (Gauss-Newton). The linear system of each is the page's own stiffness; it
is never built: conjugate gradients (Hestenes & Stiefel 1952) need no more of it than what the sticks pull when the
particles are pushed, which is one pass over the sticks. A factorisation of it costs ten times as much at a thousand
points and a gigabyte at a hundred thousand. Where a dozen passes do not do, groups of particles are moved together
(`aggregates.py`), and another thirty or so do on a page of any size.
"""

from __future__ import annotations

from math import sqrt

import numba
import numpy as np

from restore.flattening.aggregates import Aggregates, aggregate, move_rigidly
from restore.flattening.kernels import SMALL
from restore.mesh.network import spread
from restore.scan import Floats, Ints

STEPS = 8  # Newton's, at most: a page that lies nearly right needs two
LEFT = 0.1  # of the imbalance may be left by a step, and less where the steps before it did what they promised:
FORCING = 0.9  # of a power of what the last one left (Eisenstat & Walker 1996, their second choice)
POWER = (1.0 + sqrt(5.0)) / 2.0
BALANCED = 3e-4  # over √n: rms strain that a particle could still be relieved of alone. Of a strain that changes along
# the whole page alone a particle feels one part in √n; what is left moves it by a micron or two
ENOUGH = 0.5  # of that is as exact as a step need be
HALVINGS = 8  # of a step, before the page is left as it is
ALONE = 12  # passes over the sticks in a step; when they do not do, the page is seen as a whole
TOGETHER = 1000  # more, at most
STIFFEN = 1e-6  # of a particle's stiffness: one whose sticks lie in one line has none across it
TINY = 1e-300  # keeps zero over zero finite


def settle(flat: Floats, edges: Ints, lengths: Floats, steps: int = STEPS) -> Floats:
    """Flat positions (n, 2) mm of least strain: Gauss-Newton on Σ (length / rest length − 1)² over edges (e, 2)."""
    flat = flat.copy()
    descend(flat, *spread(edges, lengths), steps, 1.0)
    return flat


@numba.njit(cache=True)
def descend(flat: Floats, edges: Ints, lengths: Floats, steps: int, less: float) -> None:
    """As `settle`, flat (n, 2) mm in place, the edges gone over in the order given.

    A step that would strain the page more is halved. One that leaves more than `less` of the squared strains is the
    last.
    """
    balanced = BALANCED / sqrt(len(flat))
    last, way = 0.0, np.empty_like(flat)
    edges = edges.astype(np.uint32)
    gradients, force, inverse, strain = _linearised(flat, edges, lengths)
    for _ in range(steps):
        now = sqrt(_precondition(force, inverse, way) / len(flat))
        if now <= balanced:
            break
        left = min(LEFT, FORCING * (now / last) ** POWER) if last > 0.0 else LEFT
        left = max(left, ENOUGH * balanced / now)
        step = _balance(flat, edges, gradients, force, inverse, left)
        last, before = now, strain
        for _ in range(HALVINGS):
            flat += step
            gradients, force, inverse, strain = _linearised(flat, edges, lengths)
            if strain <= before:
                break
            flat -= step
            step *= 0.5
        if strain > less * before:
            break


@numba.njit(cache=True)
def _balance(flat: Floats, edges: Ints, gradients: Floats, force: Floats, inverse: Floats, left: float) -> Floats:
    """The step (n, 2) after which the sticks would be balanced were they linear, but for a share `left`.

    It is measured in the norm of each particle's own stiffness; force (n, 2) is written over.
    """
    step = np.zeros_like(force)
    wanted = left * left * _precondition(force, inverse, np.empty_like(force))
    if _conjugate(step, edges, gradients, force, inverse, None, wanted, ALONE) > wanted:
        together = aggregate(flat, edges, gradients)
        _conjugate(step, edges, gradients, force, inverse, together, wanted, TOGETHER)
    return step


@numba.njit(cache=True)
def _conjugate(
    step: Floats,
    edges: Ints,
    gradients: Floats,
    force: Floats,
    inverse: Floats,
    together: Aggregates | None,
    wanted: float,
    most: int,
) -> float:
    """Go on with a step (n, 2) until no more than wanted of the force (n, 2) is left, or `most` times; what is left."""
    push, pulled, way = np.zeros_like(force), np.empty_like(force), np.empty_like(force)
    left, before = _precondition(force, inverse, way), np.inf
    for _ in range(most):
        if left <= wanted:
            break
        now = left
        if together is not None:
            now += move_rigidly(together, force, way)
        carried = now / before
        for i in range(len(force)):
            for axis in range(2):
                push[i, axis] = way[i, axis] + carried * push[i, axis]
        stiffness = _pull(push, gradients, edges, pulled)
        along = now / max(stiffness, TINY)
        for i in range(len(force)):
            for axis in range(2):
                step[i, axis] += along * push[i, axis]
                force[i, axis] -= along * pulled[i, axis]
        before, left = now, _precondition(force, inverse, way)
    return left


@numba.njit(cache=True)
def _linearised(flat: Floats, edges: Ints, lengths: Floats) -> tuple[Floats, Floats, Floats, float]:
    """Gradients (e, 2) of the strains, forces (n, 2) of the sticks, inverse stiffness (n, 3) of each: xx, xy, yy.

    And the sum of the squared strains.
    """
    gradients, force, inverse = np.empty((len(edges), 2)), np.zeros_like(flat), np.zeros((len(flat), 3))
    strain = 0.0
    for k in range(len(edges)):
        a, b = edges[k, 0], edges[k, 1]
        x, y = flat[b, 0] - flat[a, 0], flat[b, 1] - flat[a, 1]
        distance = sqrt(x * x + y * y) + SMALL
        x, y = x / (distance * lengths[k]), y / (distance * lengths[k])
        gradients[k, 0], gradients[k, 1] = x, y
        slack = 1.0 - distance / lengths[k]
        strain += slack * slack
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
        share = 1.0 / max(xx * yy - xy * xy, TINY)
        inverse[i, 0], inverse[i, 1], inverse[i, 2] = share * yy, -share * xy, share * xx
    return gradients, force, inverse, strain


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
