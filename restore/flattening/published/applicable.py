"""The applicable surface of Pilu, a lattice bent onto the sheet.

Source: Pilu, "Undoing paper curl distortion using applicable surfaces", CVPR 2001.
A surface is applicable to the plane when it can be unrolled into it without stretching. Here it is a rectangular
lattice whose flat positions are known: it is bent until it passes the vertices of the sheet, while sides and diagonals
of its cells keep their flat lengths. The page consists of the vertices' feet, the points of the lattice next to them,
in the lattice's flat coordinates. Gauss–Newton bends the lattice with the feet free to slide along it (point-to-plane
distances); between two steps the feet follow. The first feet are those of the conformal map. The lattice knows the
vertices alone, no lengths of edges; a crease that runs across its cells is rounded off.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, sqrt
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_matrix, diags, identity, kron
from scipy.sparse.linalg import splu

from restore.flattening.conformal import flatten_conformal
from restore.flattening.solution import Follow, Solution
from restore.mesh.network import Network
from restore.mesh.pose import PosedSheet
from restore.numerics.limits import TINY
from restore.scan import Floats, Ints

MAX_CELLS = 5000  # of the lattice: a step takes a second, and the page's errors are those of the scan by then
MARGIN = 2  # cells beyond the first feet on every side, for those that slide outward
BENDING = 1e-3  # resistance of the nodes to bending, over that of the cells to stretching: where no vertex is near
DAMPING = 1e-6  # of the diagonal: a flat lattice in its plane resists no motion across it
HALVINGS = 3  # of a step, of the nodes or of a foot: it may overshoot where the lattice has a kink
MAX_ITERATIONS = 30
MIN_DECREASE = 1e-3  # of the energy, in one iteration: the feet still slide by less than the scan's noise


@dataclass(frozen=True)
class Lattice:
    """Rectangle of rows × cols nodes, with cells of step × step mm.

    The nodes are numbered row by row.
    """

    rows: int
    cols: int
    step: float

    @property
    def count(self) -> int:
        """How many nodes there are."""
        return self.rows * self.cols

    def sides(self) -> tuple[Ints, Floats]:
        """Return the pairs of nodes of sides and diagonals, and their lengths.

        Pairs (k, 2) over the sides and both diagonals of the cells, with their flat distances (k,) mm.
        """
        node = np.arange(self.count).reshape(self.rows, self.cols)
        straight = [(node[:, :-1], node[:, 1:]), (node[:-1], node[1:])]
        oblique = [(node[:-1, :-1], node[1:, 1:]), (node[:-1, 1:], node[1:, :-1])]
        pairs = [np.stack([a.ravel(), b.ravel()], axis=1) for a, b in straight + oblique]
        spans = np.repeat([1.0, 1.0, sqrt(2.0), sqrt(2.0)], [len(pair) for pair in pairs])
        return np.concatenate(pairs), self.step * spans

    def bending(self) -> csc_matrix:
        """Return the squared second differences along rows and columns as a quadratic form.

        Returns (count, count).
        """
        node = np.arange(self.count).reshape(self.rows, self.cols)
        lines = (node[:, :-2], node[:, 1:-1], node[:, 2:]), (node[:-2], node[1:-1], node[2:])
        at = np.concatenate([np.stack([part.ravel() for part in line], axis=1) for line in lines])
        second = _sparse(at, np.tile([1.0, -2.0, 1.0], (len(at), 1)), self.count)
        return (second.T @ second).tocsc()

    def cells(self, feet: Floats) -> tuple[Ints, Floats]:
        """Return the cell of each foot and the position in it.

        feet: (n, 2). Returns the cell's nodes (n, 4), and positions (n, 2), 0 to 1.
        """
        cell = np.clip(np.floor(feet).astype(np.int64), 0, [self.cols - 2, self.rows - 2])
        first = cell[:, 1] * self.cols + cell[:, 0]
        corners = np.array([0, 1, self.cols, self.cols + 1])
        return np.asarray(first[:, None] + corners), feet - cell


class Bent(NamedTuple):
    """Lattice in space.

    nodes: (count, 3) mm.
    feet: (n, 2), of the points, in cells.
    energy: mm².
    """

    nodes: Floats
    feet: Floats
    energy: float


def flatten_applicable(posed: PosedSheet, network: Network, follow: Follow | None = None) -> Solution:
    """Flatten a sheet by an applicable lattice.

    follow: called as follow(step, positions (n, 3) mm) with the flat positions after each step.
    Returns flat positions (n, 2) mm; the residual is the last slide of the feet, in cells. Raises BadInput for a sheet
    whose parts are connected by single points, since no lattice joins them.
    """
    lattice, feet = lattice_over(flatten_conformal(posed, network).flat)
    points, pairs, spans = posed.positions, *lattice.sides()
    bending = kron(BENDING * lattice.bending(), identity(3)).tocsc()

    def settled(nodes: Floats, feet: Floats) -> Bent:
        feet = slid(lattice, nodes, feet, points)
        at, within = lattice.cells(feet)
        energy = ((points - _surface(nodes[at], within)) ** 2).sum() + ((_lengths(nodes, pairs) - spans) ** 2).sum()
        return Bent(nodes, feet, float(energy + nodes.ravel() @ (bending @ nodes.ravel())))

    found = settled(_first_nodes(lattice, feet, points), feet)
    for iteration in range(1, MAX_ITERATIONS + 1):
        step, last = _step(lattice, found, points, bending), found
        tries = (settled(last.nodes + 0.5**halving * step, last.feet) for halving in range(HALVINGS + 1))
        found = next((tried for tried in tries if tried.energy < last.energy), last)
        if follow:
            follow(iteration, np.column_stack([lattice.step * found.feet, np.zeros(len(points))]))
        if converged := found.energy > (1.0 - MIN_DECREASE) * last.energy:
            break
    slide = float(np.sqrt(((found.feet - last.feet) ** 2).sum(axis=1).mean()))
    return Solution(lattice.step * found.feet, iteration, slide, converged)


def lattice_over(flat: Floats) -> tuple[Lattice, Floats]:
    """Return a lattice along the principal axes of a page.

    flat: (n, 2) mm. Returns also the positions (n, 2) in cells: column, row.
    """
    offsets = flat - flat.mean(axis=0)
    _, axes = np.linalg.eigh(offsets.T @ offsets)
    long, wide = axes[:, 1], np.array([-axes[1, 1], axes[0, 1]])  # never mirrored
    own = offsets @ np.stack([long, wide], axis=1)
    low, size = own.min(axis=0), np.ptp(own, axis=0)
    # A vertex to a cell: on a coarser lattice a wave is flattened, on a finer one cells have no vertex.
    cells = min(len(flat), MAX_CELLS)
    step = max(sqrt(float(size.prod()) / cells), float(size.max()) / cells)
    cols, rows = (ceil(extent / step) + 1 + 2 * MARGIN for extent in size)
    return Lattice(rows, cols, step), (own - low) / step + MARGIN


def _first_nodes(lattice: Lattice, feet: Floats, points: Floats) -> Floats:
    """Return the nodes of the smoothest lattice through points.

    points: (n, 3) mm, at given feet (n, 2). Returns (count, 3) mm.
    """
    at, within = lattice.cells(feet)
    place = _sparse(at, _fractions(within), lattice.count)
    return _solved(place.T @ place + BENDING * lattice.bending(), place.T @ points)


def _step(lattice: Lattice, bent: Bent, points: Floats, bending: csc_matrix) -> Floats:
    """Return the nodes' Gauss–Newton step, (count, 3) mm, on lengths, (n, 3) mm and bending."""
    nodes, (at, within) = bent.nodes, lattice.cells(bent.feet)
    normals = np.cross(*_tangents(nodes[at], within))
    normals /= np.maximum(np.linalg.norm(normals, axis=1), TINY)[:, None]
    distance = (normals * (points - _surface(nodes[at], within))).sum(axis=1)
    attract = _vectors(at, _fractions(within)[:, :, None] * normals[:, None], lattice.count)
    pairs, spans = lattice.sides()
    lengths = _lengths(nodes, pairs)
    ways = (nodes[pairs[:, 1]] - nodes[pairs[:, 0]]) / lengths[:, None]
    keep = _vectors(pairs, np.stack([-ways, ways], axis=1), lattice.count)
    stiffness = attract.T @ attract + keep.T @ keep + bending
    force = attract.T @ distance + keep.T @ (spans - lengths) - bending @ nodes.ravel()
    # Beyond a cell the linear model does not hold.
    return _limited(_solved(stiffness, force).reshape(-1, 3), lattice.step)


def slid(lattice: Lattice, nodes: Floats, feet: Floats, points: Floats) -> Floats:
    """Return the feet moved towards the lattice points next to the points.

    feet: (n, 2).
    points: (n, 3) mm. No foot moves away from its point.
    """
    at, within = lattice.cells(feet)
    right, up = _tangents(nodes[at], within)
    offset = points - _surface(nodes[at], within)
    along, across = (offset * right).sum(axis=1), (offset * up).sum(axis=1)
    a, b, c = (right * right).sum(axis=1), (right * up).sum(axis=1), (up * up).sum(axis=1)
    step = np.stack([c * along - b * across, a * across - b * along], axis=1)
    step = _limited(step / np.maximum(a * c - b * b, TINY)[:, None], 1.0)
    last, found = (offset**2).sum(axis=1), feet
    for halving in range(HALVINGS + 1):
        tried = feet + 0.5**halving * step
        at, within = lattice.cells(tried)
        nearer = ((points - _surface(nodes[at], within)) ** 2).sum(axis=1) < last
        found = np.where((nearer & (found == feet).all(axis=1))[:, None], tried, found)
    return found


def _lengths(nodes: Floats, pairs: Ints) -> Floats:
    """Return the distances (k,) mm between pairs (k, 2) of nodes (count, 3) mm."""
    return np.maximum(np.linalg.norm(nodes[pairs[:, 1]] - nodes[pairs[:, 0]], axis=1), TINY)


def _limited(steps: Floats, most: float) -> Floats:
    """Steps (n, d), none longer than the most."""
    lengths = np.linalg.norm(steps, axis=1)
    return np.asarray(steps * (most / np.maximum(lengths, most))[:, None])


def _fractions(within: Floats) -> Floats:
    """Return the weights (n, 4) of a cell's nodes at positions within (n, 2)."""
    x, y = within.T
    return np.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y], axis=1)


def _surface(corners: Floats, within: Floats) -> Floats:
    """Return the points (n, 3) mm of cells at positions within them.

    corners: (n, 4, 3) mm.
    """
    return np.asarray((_fractions(within)[:, :, None] * corners).sum(axis=1))


def _tangents(corners: Floats, within: Floats) -> tuple[Floats, Floats]:
    """Return the derivatives of cell points along row and column.

    corners: (n, 4, 3) mm. Returns (n, 3) mm each, for a step of one cell.
    """
    x, y = within.T[:, :, None]
    a, b, c, d = corners.transpose(1, 0, 2)
    return (1 - y) * (b - a) + y * (d - c), (1 - x) * (c - a) + x * (d - b)


def _vectors(at: Ints, ways: Floats, count: int) -> csc_matrix:
    """Return a sparse matrix of vectors of nodes, row by row.

    ways: (m, k, 3), of the nodes at (m, k). Returns (m, 3 · count).
    """
    places = 3 * at[:, :, None] + np.arange(3)
    return _sparse(places.reshape(len(at), -1), ways.reshape(len(at), -1), 3 * count)


def _sparse(at: Ints, values: Floats, count: int) -> csc_matrix:
    """Return a sparse matrix (m, count) of values (m, k) in columns at (m, k)."""
    rows = np.repeat(np.arange(len(at)), at.shape[1])
    return csc_matrix((values.ravel(), (rows, at.ravel())), shape=(len(at), count))


def _solved(stiffness: csc_matrix, force: Floats) -> Floats:
    damped = (stiffness + DAMPING * diags(stiffness.diagonal())).tocsc()
    factors = splu(damped, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return np.asarray(factors.solve(force))
