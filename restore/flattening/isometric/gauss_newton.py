"""Flat positions of least squared edge strain near a start, by Gauss–Newton.

The normal equations of a step are the page's own stiffness matrix. It is never built: conjugate gradients (Hestenes &
Stiefel 1952) need its product with a displacement, which is one pass over the edges. A factorisation costs ten times as
much at a thousand vertices and a gigabyte at a hundred thousand (`preconditioner.py`).
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numba
import numpy as np

from restore.flattening.isometric.angle_synchronisation import SHORTEST
from restore.flattening.isometric.preconditioner import STIFFEN, Preconditioner, precondition, prepared, rim_first
from restore.flattening.solution import Solution
from restore.mesh.measures import edge_strain, straight_lengths
from restore.mesh.network import Network
from restore.numerics.limits import SMALL, TINY, overflows_silently, sum_in_order
from restore.numerics.robust import robust_sigma
from restore.scan import Floats, Ints

MAX_ITERATIONS = 200  # a developable sheet needs two to five, the least distorted page of another dozens
GRADIENT_TOLERANCE = 3e-6  # rms strain that a vertex could be relieved of alone, times √n: of a strain that changes
# along the whole page alone a vertex feels one part in √n. What is left moves a vertex by 10⁻⁵ of an edge
MIN_DECREASE = 0.01  # of the energy in an iteration: steps to exact lengths decrease it by nearly all, and where
# lengths contradict each other they get slowly shorter
MAX_STRAIN = 0.03  # rms: no paper stretches so far. What does is not developable, or not a mesh of one sheet;
# and a page that stands still where its vertices could be relieved of that much has not been found
INEXACTNESS = 0.03  # of the gradient, by its work, may be left by a linear solve: with more, bends of the page are left


@overflows_silently
def minimise_strain(
    flat: Floats, network: Network, most: int = MAX_ITERATIONS, *, corner: float = np.inf, other: Floats | None = None
) -> Solution:
    """Minimise Σ area · ρ(length / rest length − 1) over the edges.

    The area is that of the faces at an edge: the sum stands for the integral over the page. ρ(s) is s², and beyond the
    corner, a strain, becomes 2 · corner · |s| (pseudo-Huber): a few wrong rest lengths then hardly move the page. An
    iteration that decreases the sum by a smaller fraction than MIN_DECREASE is the last.
    flat: (n, 2) mm, the start.
    most: maximum number of iterations.
    other: (e,) mm, a second rest length for each edge; any length between the two costs nearly the same.
    Returns flat positions (n, 2) mm.
    """
    lengths = network.lengths[:, None] if other is None else np.column_stack([network.lengths, other])
    areas = edge_areas(network)
    vertices, order, edges = rim_first(flat, network.edges)
    found = flat[vertices]
    iterations, residual, converged = _minimise(found, edges, 1.0 / lengths[order], areas[order], corner, most)
    return Solution(found[np.argsort(vertices)], iterations, residual, converged)


def least_absolute_strain(found: Solution, network: Network, other: Floats | None = None) -> Solution:
    """From the page of least squared strain to the one of least absolute strain.

    The corner of the pseudo-Huber loss is the robust standard deviation of the strains that least squares leave. Where
    other lengths (e,) mm are given, both lengths of an edge count. A vertex that slivers alone hold weighs next to
    nothing: one whose edges all come out more than twice as long as at rest stays where least squares had it.
    """
    corner = max(robust_sigma(edge_strain(found.flat, network.edges, network.lengths)), SMALL)
    again = minimise_strain(found.flat, network, corner=corner, other=other)
    held = np.zeros((len(found.flat), 1), bool)
    held[network.edges[edge_strain(again.flat, network.edges, network.lengths) < 1.0]] = True
    flat, iterations = np.where(held, again.flat, found.flat), found.iterations + again.iterations
    return again._replace(flat=flat, iterations=iterations)


def mean_strain(flat: Floats, network: Network) -> float:
    """Return the mean relative error of the edge lengths of a page.

    flat: (n, 2) mm. Weighted by the lengths.
    """
    return float(np.abs(straight_lengths(flat, network.edges) - network.lengths).sum() / network.lengths.sum())


def strained_less(flat: Floats, other: Floats, network: Network) -> bool:
    """Return whether a page is strained clearly less than another.

    flat, other: (n, 2) mm. In the mean, and by more than GRADIENT_TOLERANCE.
    """
    return mean_strain(flat, network) < mean_strain(other, network) - GRADIENT_TOLERANCE


@overflows_silently
def edge_areas(network: Network) -> Floats:
    """Return the area at rest that each edge stands for.

    It is a third of the areas of its faces, with a mean of 1. None is less than SHORTEST but of shorter edges, or no
    step would be too long for a vertex that slivers alone hold. Returns (e,).
    """
    edge, lengths, count = network.sides.edge, network.lengths, len(network.lengths)
    thirds = np.repeat(network.areas, 3)[edge >= 0] / 3.0
    areas: Floats = np.asarray(np.bincount(edge[edge >= 0], thirds, count), np.float64)
    least = SHORTEST * np.minimum(lengths / (SHORTEST * (sum_in_order(lengths) / count)), 1.0) ** 2
    return np.maximum(areas / max(sum_in_order(areas) / count, TINY), least)


class Linearised(NamedTuple):
    """Linearisation of the energy at a page.

    jacobian: (e, 2), of the strains, weighted by the roots of areas, for the end of each edge.
    gradient: (n, 2), negative, of the sum of squares.
    blocks: (n, 3), diagonal blocks of its stiffness: xx, xy, yy.
    energy: the sum of squares.
    """

    jacobian: Floats
    gradient: Floats
    blocks: Floats
    energy: float


def _minimise(
    flat: Floats, edges: Ints, per: Floats, areas: Floats, corner: float, most: int
) -> tuple[int, float, bool]:
    """Minimise as `minimise_strain`, in place.

    flat: (n, 2) mm, in the order of `rim_first`, as are the edges (e, 2).
    per: (e, ·) 1/mm, one over each rest length of an edge.
    A step that would strain the page more is halved.
    """
    tolerance = GRADIENT_TOLERANCE / sqrt(len(flat))
    now = _linearised(flat, edges, per, areas, corner)
    residual = _relief(now)
    for iteration in range(most):
        if not residual > tolerance:  # or not finite
            return iteration, residual, residual <= tolerance
        before, step = now, np.zeros_like(flat)
        by = prepared(flat, edges, now.jacobian, now.blocks)
        conjugate_gradients(step, edges, now.jacobian, now.gradient.copy(), by, INEXACTNESS)
        step *= 2.0
        while True:  # at the latest until rounding leaves nothing of the step
            step *= 0.5
            now = _linearised(flat + step, edges, per, areas, corner)
            if not now.energy > before.energy:
                break
        flat += step
        further = _further(before.gradient, now.gradient, step) if corner < np.inf else 0.0
        if further > 0.0:
            flat += further * step
            now = _linearised(flat, edges, per, areas, corner)
        residual = _relief(now)
        if now.energy > (1.0 - MIN_DECREASE) * before.energy:
            return iteration + 1, residual, residual <= MAX_STRAIN
    return most, residual, False


def _further(before: Floats, after: Floats, step: Floats) -> float:
    """Return by which fraction of a step to extend it.

    The squares that stand for a loss bound it from above, and their steps fall short. The step is extended to where the
    slope along it vanishes by the secant, at most to twice its length so that the loss does not grow.
    before, after: (n, 2), negative gradients before and after the step (n, 2).
    """
    first, last = sum_in_order((before * step).ravel()), sum_in_order((after * step).ravel())
    return min(last / (first - last), 1.0) if 0.0 < last < first else 0.0


def conjugate_gradients(
    step: Floats, edges: Ints, jacobian: Floats, rest: Floats, by: Preconditioner, fraction: float
) -> int:
    """Solve for a step until `fraction` of the residual is left.

    step: (n, 2), continued in place, as is its residual `rest` (n, 2). Returns the number of passes.
    """
    return int(_go_on(step, edges, jacobian, rest, by, fraction, np.zeros_like(rest), *np.empty((2, *rest.shape))))


@numba.njit(cache=True)
def _go_on(
    step: Floats, edges: Ints, jacobian: Floats, rest: Floats, by: Preconditioner, fraction: float,
    search: Floats, product: Floats, direction: Floats,
) -> int:  # fmt: skip
    """Iterate `conjugate_gradients`.

    search: (n, 2) zeros.
    product, direction: (n, 2) scratch.
    """
    before, wanted = np.inf, 0.0
    for taken in range(rest.size):
        now = precondition(by, edges, jacobian, rest, direction)
        wanted = wanted if taken else fraction * fraction * now
        if now <= wanted:
            return taken
        conjugate = now / before
        for i in range(len(rest)):
            for axis in range(2):
                search[i, axis] = direction[i, axis] + conjugate * search[i, axis]
        along = now / max(_stiffness_times(search, jacobian, edges, product), TINY)
        for i in range(len(rest)):
            for axis in range(2):
                step[i, axis] += along * search[i, axis]
                rest[i, axis] -= along * product[i, axis]
        before = now
    return rest.size


def _linearised(flat: Floats, edges: Ints, per: Floats, areas: Floats, corner: float) -> Linearised:
    """The sum of squares at flat (n, 2) mm, with areas (e,)."""
    jacobian, gradient, blocks = np.empty((len(edges), 2)), np.zeros_like(flat), np.zeros((len(flat), 3))
    energy = _linearise(flat, edges, per, areas, 1.0 / corner, jacobian, gradient, blocks)
    return Linearised(jacobian, gradient, blocks, energy)


@numba.njit(cache=True, error_model="numpy")
def _linearise(
    flat: Floats, edges: Ints, per: Floats, areas: Floats, steep: float,
    jacobian: Floats, gradient: Floats, blocks: Floats,
) -> float:  # fmt: skip
    """Write the Jacobian, add to gradient and blocks, return the energy.

    jacobian: (e, 2).
    gradient: (n, 2).
    blocks: (n, 3).
    steep: 1 / corner.
    """
    energy = 0.0
    for k in range(len(edges)):
        a, b = edges[k, 0], edges[k, 1]
        x, y = flat[b, 0] - flat[a, 0], flat[b, 1] - flat[a, 1]
        distance, stiffness, pull = sqrt(x * x + y * y) + SMALL, 0.0, 0.0
        for m in range(per.shape[1]):
            slack = 1.0 - distance * per[k, m]
            bend = sqrt(1.0 + (slack * steep) ** 2)
            energy += 2.0 * areas[k] * slack * slack / (1.0 + bend)
            fraction = areas[k] * per[k, m] / bend
            stiffness += fraction * per[k, m]
            pull += fraction * slack
        root, x, y = sqrt(stiffness), x / distance, y / distance
        jacobian[k, 0], jacobian[k, 1] = root * x, root * y
        xx, xy, yy = stiffness * x * x, stiffness * x * y, stiffness * y * y
        gradient[a, 0] -= pull * x
        gradient[a, 1] -= pull * y
        gradient[b, 0] += pull * x
        gradient[b, 1] += pull * y
        for end in range(2):
            i = edges[k, end]
            blocks[i, 0] += xx
            blocks[i, 1] += xy
            blocks[i, 2] += yy
    for i in range(len(blocks)):
        more = STIFFEN * (blocks[i, 0] + blocks[i, 2]) + TINY
        blocks[i, 0] += more
        blocks[i, 2] += more
    return energy


def _relief(at: Linearised) -> float:
    """The strain that a vertex could be relieved of if the others stood still, rms."""
    x, y = at.gradient.T
    xx, xy, yy = at.blocks.T
    squares = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / np.maximum(xx * yy - xy * xy, TINY)
    return sqrt(sum_in_order(squares) / len(squares))


@numba.njit(cache=True)
def _stiffness_times(moved: Floats, jacobian: Floats, edges: Ints, product: Floats) -> float:
    """Write the stiffness matrix times a displacement (n, 2).

    Returns the quadratic form of the displacement.
    """
    total = 0.0
    for i in range(len(product)):
        product[i, 0] = product[i, 1] = 0.0
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
