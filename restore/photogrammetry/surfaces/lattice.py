"""Heights of a lattice over a smooth sheet, through points.

They bend as little, or in as few places, as can be. The bends of a paper that has creases are zero but in few places. A
sum of a concave function of them is least where they are few (Candès, Wakin & Boyd, "Enhancing sparsity by reweighted
l1 minimization", 2008); it is found by least squares with weights from the bends of the step before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np
import scipy.sparse as sp
from scipy.linalg import solveh_banded
from threadpoolctl import threadpool_limits

from restore.numerics.robust import CAUCHY
from restore.scan import Floats, Ints, Mask

NOISE_MM = 0.04  # of a point: twice what patches of 2400 pixels leave on paper that fills most of a photograph
BENDING = 3.0  # of the bends, mm⁻², against the squared distances of the points in standard deviations
MIN_BEND = 2e-3  # 1/mm: paper with less is flat
CREASE_BEND = 0.3  # 1/mm: of a crease of 25° on a lattice of 1.4 mm; a bend as large has the same weight in each stage
LOOSE = 1e-6  # of a height that no equation determines
REACH = 2  # nodes on either side of a second difference of second differences

Stages = Sequence[tuple[float, int]]
"""Exponents of the bends, and steps.

2 for all of one weight, 1 for their sum, 0 for the sum of their logarithms.
"""


@dataclass(frozen=True, eq=False)
class Cloud:
    """Measured points (n, 3) mm, their feet and their noise.

    feet: (n, 2) mm, on the base of a relief.
    noise: (n,) mm, standard deviations.
    of_facets: (n,), False for those of the page's edge: a line says nothing of how its facet is tilted.
    """

    points: Floats
    feet: Floats
    noise: Floats
    of_facets: Mask

    @classmethod
    def of(cls, points: Floats, feet: Floats, noise: Floats | float = NOISE_MM, *, of_facets: bool = True) -> Cloud:
        """Return a cloud of points that all are of facets or all are not.

        points: (n, 3) mm.
        feet: (n, 2) mm.
        noise: (n,) mm, or one for all.
        """
        return cls(points, feet, np.broadcast_to(noise, len(points)), np.full(len(points), of_facets))

    def joined(self, other: Cloud) -> Cloud:
        """Both clouds as one."""
        pairs = ((getattr(self, field.name), getattr(other, field.name)) for field in fields(self))
        return Cloud(*(np.concatenate(pair) for pair in pairs))


@dataclass(frozen=True, eq=False)
class Lattice:
    """Nodes of a smooth sheet: points and unit normals (rows, cols, 3).

    They are a step apart from low (2,) mm on.
    """

    low: Floats
    step: float
    points: Floats
    normals: Floats

    @property
    def places(self) -> Floats:
        """Return the places (rows, cols, 2) of the nodes, mm."""
        rows, cols = self.points.shape[:2]
        x, y = self.low[0] + self.step * np.arange(cols), self.low[1] + self.step * np.arange(rows)
        return np.stack(np.meshgrid(x, y), axis=-1)

    def part(self, low: Floats, high: Floats) -> tuple[Lattice, tuple[slice, slice]]:
        """Return the nodes from places low (2,) to high (2,) mm.

        Returns also which rows and columns they are.
        """
        first = np.maximum(np.ceil((low - self.low) / self.step).astype(int), 0)
        last = np.floor((high - self.low) / self.step).astype(int) + 1
        at = slice(first[1], last[1]), slice(first[0], last[0])
        return Lattice(self.low + first * self.step, self.step, self.points[at], self.normals[at]), at

    def raised(self, heights: Floats) -> Floats:
        """Return the nodes (rows, cols, 3) mm at heights (rows, cols) mm."""
        return self.points + heights[..., None] * self.normals

    def heights_at(self, heights: Floats, places: Floats) -> Floats:
        """Return heights (n,) mm at places (n, 2) mm.

        Beyond the lattice those of its border are prolonged.
        heights: (rows, cols).
        """
        return np.asarray(self._weights(places) @ heights.ravel())

    def fitted(
        self, places: Floats, heights: Floats, stages: Stages, *, start: Floats | None = None, weight: float = BENDING,
        normal: Floats | None = None, noise: Floats | float = NOISE_MM,
    ) -> Floats:  # fmt: skip
        """Fit heights (rows, cols) mm of the nodes through points.

        places, heights: (n, 2) mm and (n,), of the points.
        weight: of the bends.
        normal: (3,), of the plane that they are to be near to; None for the surface itself.
        noise: (n,) mm, standard deviations of the points.
        """
        order = _shorter_first(*self.points.shape[:2])
        reach = REACH * (min(self.points.shape[:2]) + 1)
        shown = self._weights(places)
        found = None if start is None else start.ravel().copy()
        for exponent, steps in stages:
            for _ in range(steps):
                rows, sides = self._bends(found, normal)
                resisting = weight / self.step**2 * self._resistances(rows, sides, found, exponent)
                trusted = np.broadcast_to(np.asarray(noise) ** -2.0, heights.shape)
                if found is not None:
                    trusted = trusted / (1.0 + ((shown @ found - heights) / (CAUCHY * noise)) ** 2)
                gram = shown.T @ sp.diags(trusted) @ shown + LOOSE * sp.eye(shown.shape[1])
                side = shown.T @ (trusted * heights)
                for row, known in zip(rows, sides, strict=True):
                    gram = gram + row.T @ (sp.diags(resisting) @ row)
                    side -= row.T @ (resisting * known)
                found = _solved(gram.tocsr(), side, order, reach)
        assert found is not None
        return found.reshape(self.points.shape[:2])

    def _bends(self, heights: Floats | None, normal: Floats | None) -> tuple[list[sp.csr_matrix], list[Floats]]:
        """Return second differences out of the surface of heights (n,).

        As rows · heights + sides, one for uu, uv and vv each.
        """
        shape = self.points.shape[:2]
        if normal is None:
            surface = self.points if heights is None else self.raised(heights.reshape(shape))
            directions = node_normals(surface)[1:-1, 1:-1].reshape(-1, 3)
        else:
            directions = np.broadcast_to(normal, ((shape[0] - 2) * (shape[1] - 2), 3))
        points, normals = self.points.reshape(-1, 3), self.normals.reshape(-1, 3)
        rows, sides = [], []
        for difference in _second_differences(*shape):
            axes = (sp.diags(directions[:, k]) @ difference @ sp.diags(normals[:, k]) for k in range(3))
            rows.append(sum(axes, sp.csr_matrix(difference.shape)).tocsr())
            sides.append(((difference @ points) * directions).sum(axis=1))
        return rows, sides

    def _resistances(
        self, rows: list[sp.csr_matrix], sides: list[Floats], heights: Floats | None, exponent: float
    ) -> Floats:
        """Return the bend's weight (m,) at inner nodes, less where heights (n,) bend much."""
        if heights is None or exponent == 2.0:
            return np.full(len(sides[0]), 1.0 / CREASE_BEND)
        squares = sum((row @ heights + side) ** 2 for row, side in zip(rows, sides, strict=True)) / self.step**4
        return np.asarray((squares + MIN_BEND**2) ** (exponent / 2 - 1) * CREASE_BEND ** (1 - exponent))

    def _weights(self, places: Floats) -> sp.csr_matrix:
        """Return bilinear weights (n, nodes) of the nodes at places (n, 2) mm."""
        rows, cols = self.points.shape[:2]
        at = (places - self.low) / self.step
        first = np.clip(np.floor(at).astype(np.int64), 0, [cols - 2, rows - 2])
        (a, b), corner = (at - first).T, first[:, 1] * cols + first[:, 0]
        nodes = np.stack([corner, corner + 1, corner + cols, corner + cols + 1], axis=1)
        weights = np.stack([(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b], axis=1)
        number = np.repeat(np.arange(len(places)), 4)
        return sp.csr_matrix((weights.ravel(), (number, nodes.ravel())), (len(places), rows * cols))


def node_normals(points: Floats) -> Floats:
    """Return unit normals (rows, cols, 3) of points (rows, cols, 3)."""
    normals = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    return np.asarray(normals / np.linalg.norm(normals, axis=2, keepdims=True))


@lru_cache(maxsize=1)
def _second_differences(rows: int, cols: int) -> tuple[sp.csr_matrix, ...]:
    """Return second differences by uu, uv and vv at the inner nodes.

    The mixed one counts twice in the square of all.
    """

    def along(weights: tuple[float, ...], count: int) -> sp.csr_matrix:
        return sp.diags(weights, range(3), shape=(count - 2, count), dtype=float, format="csr")

    bend, slope, middle = (1.0, -2.0, 1.0), (-0.5, 0.0, 0.5), (0.0, 1.0, 0.0)
    uu = sp.kron(along(middle, rows), along(bend, cols), format="csr")
    uv = np.sqrt(2.0) * sp.kron(along(slope, rows), along(slope, cols), format="csr")
    return uu, uv, sp.kron(along(bend, rows), along(middle, cols), format="csr")


def _shorter_first(rows: int, cols: int) -> Ints:
    """Return the nodes (n,) in the order of the narrower band."""
    number = np.arange(rows * cols).reshape(rows, cols)
    return (number.T if cols > rows else number).ravel()


def _solved(gram: sp.csr_matrix, side: Floats, order: Ints, reach: int) -> Floats:
    """Solve symmetric banded equations.

    order: (n,), in which the band is as wide as reach. Returns (n,).
    """
    lower = sp.tril(gram[order][:, order]).tocoo()
    band = np.zeros((reach + 1, len(side)))
    band[lower.row - lower.col, lower.col] = lower.data
    solution = np.empty_like(side)
    with threadpool_limits(1, "blas"):  # two threads take twice as long, or twenty times: blocks are small
        solution[order] = solveh_banded(band, side[order], lower=True, overwrite_ab=True, check_finite=False)
    return solution
