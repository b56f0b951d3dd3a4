"""The flat positions of least strain near a start: Gauss–Newton on the sum of squared edge strains.

The normal equations of a step are the page's own stiffness matrix. It is never built: conjugate gradients (Hestenes &
Stiefel 1952) need its product with a displacement, which is one pass over the edges. A factorisation costs ten times as
much at a thousand vertices and a gigabyte at a hundred thousand. They are preconditioned by the diagonal blocks and
the rigid modes of vertex aggregates (`rigid_aggregates.py`).
"""

from __future__ import annotations

from math import sqrt

import numba
import numpy as np

from restore.flattening.rigid_aggregates import STIFFEN, Aggregates, aggregate, correct_rigidly
from restore.flattening.solution import Solution
from restore.mesh.adjacency import Sides
from restore.mesh.measures import edge_strain, straight_lengths
from restore.mesh.network import Network
from restore.numerics import SMALL, TINY
from restore.robust import robust_sigma
from restore.scan import Floats, Ints

MOST_ITERATIONS = 200  # a developable sheet needs two to five, the least distorted page of another dozens
GRADIENT_TOLERANCE = 3e-6  # rms strain that a vertex could be relieved of alone, times √n: of a strain that changes
# along the whole page alone a vertex feels one part in √n. What is left moves a vertex by 10⁻⁵ of an edge
LEAST_DECREASE = 0.01  # of the energy in an iteration: steps to exact lengths decrease it by nearly all, and where
# lengths contradict each other they get slowly shorter
MOST_STRAIN = 0.03  # rms: no paper stretches so far. What does is not developable, or not a mesh of one sheet;
# and a page that stands still where its vertices could be relieved of so much has not been found
INEXACTNESS = 0.03  # of the gradient may be left by a linear solve: with more, what bends the whole page is left


def minimise_strain(
    flat: Floats, network: Network, most: int = MOST_ITERATIONS, *, corner: float = np.inf, other: Floats | None = None
) -> Solution:
    """Flat positions (n, 2) mm of least Σ area · ρ(length / rest length − 1) over the edges of a network.

    The area is that of the faces at an edge: the sum stands for the integral over the page. ρ(s) is s², and beyond the
    corner, a strain, becomes 2 · corner · |s| (pseudo-Huber): a few wrong rest lengths then hardly move the page.
    Where other (e,) mm are given, each edge has two rest lengths: any length between them costs nearly the same.
    An iteration that decreases the sum by a smaller share than LEAST_DECREASE is the last.
    """
    flat = np.array(flat, order="C")
    edges, lengths = network.edges, network.lengths
    roots = np.sqrt(edge_areas(network.faces, network.sides, lengths))
    if other is not None:
        edges, roots, lengths = np.r_[edges, edges], np.r_[roots, roots], np.r_[lengths, other]
    iterations, residual, converged = _minimise(flat, edges, lengths, roots, corner, most)
    return Solution(flat, iterations, residual, converged)


def least_absolute_strain(found: Solution, network: Network, other: Floats | None = None) -> Solution:
    """From the page of least squared strain to the one of least absolute strain.

    The corner of the pseudo-Huber loss is the robust standard deviation of the strains that least squares leave. Where
    other lengths (e,) mm are given, both lengths of an edge count.
    """
    corner = max(robust_sigma(edge_strain(found.flat, network.edges, network.lengths)), SMALL)
    again = minimise_strain(found.flat, network, corner=corner, other=other)
    return again._replace(iterations=found.iterations + again.iterations)


def mean_strain(flat: Floats, network: Network) -> float:
    """By what share the edges of flat (n, 2) mm miss their rest lengths, over the length of all of them."""
    missed = np.abs(straight_lengths(flat, network.edges) - network.lengths)
    return float(missed.sum() / network.lengths.sum())


def strained_less(flat: Floats, other: Floats, network: Network) -> bool:
    """Whether flat (n, 2) mm is strained less than other (n, 2) mm, in the mean and by more than GRADIENT_TOLERANCE."""
    return mean_strain(flat, network) < mean_strain(other, network) - GRADIENT_TOLERANCE


@numba.njit(cache=True)
def rest_areas(faces: Ints, sides: Sides, lengths: Floats) -> Floats:
    """(m,) mm² areas of faces (m, 3) whose edges have lengths (e,) mm; 0 for one that has no two different corners."""
    areas = np.zeros(len(faces))
    for f in range(len(faces)):
        if sides.edge[3 * f] < 0 or sides.edge[3 * f + 1] < 0 or sides.edge[3 * f + 2] < 0:
            continue
        a, b, c = lengths[sides.edge[3 * f]], lengths[sides.edge[3 * f + 1]], lengths[sides.edge[3 * f + 2]]
        half = 0.5 * (a + b + c)
        areas[f] = sqrt(max(half * (half - a) * (half - b) * (half - c), 0.0))  # Heron
    return areas


@numba.njit(cache=True)
def edge_areas(faces: Ints, sides: Sides, lengths: Floats) -> Floats:
    """(e,) a third of the areas of the faces at each edge, from edge lengths (e,) mm, with a mean of 1.

    None is 0: an edge of slivers alone would hold nothing.
    """
    of_faces, areas = rest_areas(faces, sides, lengths), np.zeros(len(lengths))
    for f in range(len(faces)):
        for k in range(3):
            if sides.edge[3 * f + k] >= 0:
                areas[sides.edge[3 * f + k]] += of_faces[f] / 3.0
    return np.maximum(areas / max(areas.mean(), TINY), SMALL)


@numba.njit(cache=True)
def _minimise(
    flat: Floats, edges: Ints, lengths: Floats, roots: Floats, corner: float, most: int
) -> tuple[int, float, bool]:
    """As `minimise_strain`, flat (n, 2) mm in place. A step that would strain the page more is halved."""
    tolerance = GRADIENT_TOLERANCE / sqrt(len(flat))
    step_only = np.empty_like(flat)
    edges = edges.astype(np.uint32)
    jacobian, gradient, inverse, energy = _linearised(flat, edges, lengths, roots, corner)
    residual = sqrt(_preconditioned(gradient, inverse, step_only) / len(flat))
    for iteration in range(most):
        if not residual > tolerance:  # or not finite
            return iteration, residual, residual <= tolerance
        downhill, last = gradient.copy(), energy
        step = _solved(flat, edges, jacobian, gradient, inverse)
        jacobian, gradient, inverse, energy = _linearised(flat + step, edges, lengths, roots, corner)
        while energy > last:  # at the latest until rounding leaves nothing of the step
            step *= 0.5
            jacobian, gradient, inverse, energy = _linearised(flat + step, edges, lengths, roots, corner)
        flat += step
        further = _further(downhill, gradient, step) if corner < np.inf else 0.0
        if further > 0.0:
            flat += further * step
            jacobian, gradient, inverse, energy = _linearised(flat, edges, lengths, roots, corner)
        residual = sqrt(_preconditioned(gradient, inverse, step_only) / len(flat))
        if energy > (1.0 - LEAST_DECREASE) * last:
            return iteration + 1, residual, residual <= MOST_STRAIN
    return most, residual, False


@numba.njit(cache=True)
def _further(before: Floats, after: Floats, step: Floats) -> float:
    """By what share of a step (n, 2) to go on along it, from the negative gradients (n, 2) before and after it.

    The squares that stand for a loss bound it from above, and their steps fall short: to where the slope along the
    step vanishes by the secant, which is no more than as far again if the loss shall not grow.
    """
    first, last = (before * step).sum(), (after * step).sum()
    return float(min(last / (first - last), 1.0)) if 0.0 < last < first else 0.0


@numba.njit(cache=True)
def _solved(flat: Floats, edges: Ints, jacobian: Floats, gradient: Floats, inverse: Floats) -> Floats:
    """The Gauss–Newton step (n, 2), up to INEXACTNESS; the gradient (n, 2) is written over by what is left of it."""
    step = np.zeros_like(gradient)
    wanted = INEXACTNESS * INEXACTNESS * _preconditioned(gradient, inverse, np.empty_like(gradient))
    _conjugate_gradients(step, edges, jacobian, gradient, inverse, aggregate(flat, edges, jacobian), wanted)
    return step


@numba.njit(cache=True)
def _conjugate_gradients(
    step: Floats, edges: Ints, jacobian: Floats, rest: Floats, inverse: Floats, coarse: Aggregates, wanted: float
) -> int:
    """Go on with a step (n, 2), in place, until its rest (n, 2) is no more than wanted; how many passes that takes."""
    search, product, direction = np.zeros_like(rest), np.empty_like(rest), np.empty_like(rest)
    left, before = _preconditioned(rest, inverse, direction), np.inf
    for taken in range(rest.size):
        if left <= wanted:
            return taken
        now = left + correct_rigidly(coarse, rest, direction)
        conjugate = now / before
        for i in range(len(rest)):
            for axis in range(2):
                search[i, axis] = direction[i, axis] + conjugate * search[i, axis]
        along = now / max(_stiffness_times(search, jacobian, edges, product), TINY)
        for i in range(len(rest)):
            for axis in range(2):
                step[i, axis] += along * search[i, axis]
                rest[i, axis] -= along * product[i, axis]
        before, left = now, _preconditioned(rest, inverse, direction)
    return rest.size


@numba.njit(cache=True)
def _linearised(
    flat: Floats, edges: Ints, lengths: Floats, roots: Floats, corner: float
) -> tuple[Floats, Floats, Floats, float]:
    """Jacobian (e, 2) of the strains, weighed by roots (e,), for the end of each edge, the negative gradient (n, 2) of
    their sum of squares, inverse diagonal blocks (n, 3) of its stiffness: xx, xy, yy; and the sum of squares."""
    jacobian, gradient, inverse = np.empty((len(edges), 2)), np.zeros_like(flat), np.zeros((len(flat), 3))
    energy = 0.0
    for k in range(len(edges)):
        a, b = edges[k, 0], edges[k, 1]
        x, y = flat[b, 0] - flat[a, 0], flat[b, 1] - flat[a, 1]
        distance = sqrt(x * x + y * y) + SMALL
        slack = 1.0 - distance / lengths[k]
        bend = sqrt(1.0 + (slack / corner) ** 2)
        energy += 2.0 * (roots[k] * slack) ** 2 / (1.0 + bend)
        root = roots[k] / sqrt(bend)
        x, y = root * x / (distance * lengths[k]), root * y / (distance * lengths[k])
        jacobian[k, 0], jacobian[k, 1] = x, y
        slack *= root
        gradient[a, 0] -= slack * x
        gradient[a, 1] -= slack * y
        gradient[b, 0] += slack * x
        gradient[b, 1] += slack * y
        for i in (a, b):
            inverse[i, 0] += x * x
            inverse[i, 1] += x * y
            inverse[i, 2] += y * y
    for i in range(len(flat)):
        more = STIFFEN * (inverse[i, 0] + inverse[i, 2]) + TINY
        xx, xy, yy = inverse[i, 0] + more, inverse[i, 1], inverse[i, 2] + more
        share = 1.0 / max(xx * yy - xy * xy, TINY)
        inverse[i, 0], inverse[i, 1], inverse[i, 2] = share * yy, -share * xy, share * xx
    return jacobian, gradient, inverse, energy


@numba.njit(cache=True)
def _preconditioned(rest: Floats, inverse: Floats, direction: Floats) -> float:
    """Write the direction (n, 2): the step of every vertex when the others stand still; its product with the rest."""
    total = 0.0
    for i in range(len(rest)):
        direction[i, 0] = inverse[i, 0] * rest[i, 0] + inverse[i, 1] * rest[i, 1]
        direction[i, 1] = inverse[i, 1] * rest[i, 0] + inverse[i, 2] * rest[i, 1]
        total += rest[i, 0] * direction[i, 0] + rest[i, 1] * direction[i, 1]
    return total


@numba.njit(cache=True)
def _stiffness_times(moved: Floats, jacobian: Floats, edges: Ints, product: Floats) -> float:
    """Write the stiffness matrix times a displacement (n, 2); the quadratic form of the displacement."""
    product[:] = 0.0
    total = 0.0
    for k in range(len(edges)):
        a, b = edges[k, 0], edges[k, 1]
        x, y = jacobian[k, 0], jacobian[k, 1]
        strain = x * (moved[b, 0] - moved[a, 0]) + y * (moved[b, 1] - moved[a, 1])
        total += strain * strain
        product[a, 0] -= strain * x
        product[a, 1] -= strain * y
        product[b, 0] += strain * x
        product[b, 1] += strain * y
    return total
