"""A smooth surface over the table through points of a page: a bicubic spline of heights.

The coefficients minimise the squared distances of the points and the bending of the surface (the thin plate's energy,
Duchon 1977), both as weighted least squares. Points far off have the weight that Cauchy's distribution gives them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from restore.robust import robust_sigma
from restore.scan import Floats, Ints

STEP_MM = 4.0  # of the knots: a wave of 60 mm and 30° lies within 2 µm of such a spline
BORDER = 2  # knots beyond the points on every side
REWEIGHTINGS = 5
CAUCHY = 2.5  # standard deviations at which a point has half its weight
STIFFNESSES = tuple(10.0**exponent for exponent in (4, 3, 2, 1, 0, -1))  # mm²: tried, the stiffest first
HELD_OUT = 0.1  # of the points tell which stiffness is best
GAIN = 0.99  # of the error that a softer surface must leave at most, to be preferred
LEAST_SIGMA_MM = 0.002  # of points: exact ones would all be outliers but a few
SEED = 5  # of what is held out


@dataclass(frozen=True, eq=False)
class HeightField:
    """Heights over x and y, as coefficients (rows, cols) of uniform cubic B-splines; low (2,) is the first knot."""

    low: Floats
    step: float
    coefficients: Floats

    def height(self, places: Floats) -> Floats:
        """(n,) mm at places (n, 2) mm."""
        return _design(places, self.low, self.step, self.coefficients.shape) @ self.coefficients.ravel()

    def points(self, places: Floats) -> Floats:
        """(n, 3) mm on the surface at places (n, 2) mm."""
        return np.column_stack([places, self.height(places)])

    def derivatives(self, places: Floats) -> Floats:
        """(n, 5) derivatives of the height at places (n, 2) mm: by x, by y, by xx, xy and yy."""
        orders = ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
        flat = self.coefficients.ravel()
        shape = self.coefficients.shape
        return np.stack([_design(places, self.low, self.step, shape, order) @ flat for order in orders], axis=1)

    def frames(self, places: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Points (n, 3) mm, tangents (n, 2, 3), normals (n, 3) and curvatures (n, 3) 1/mm along the tangents.

        The curvatures are those along the first, mixed and along the second: about a point the surface is
        p + a t1 + b t2 + (k11 a² + 2 k12 a b + k22 b²)/2 n.
        """
        zx, zy, zxx, zxy, zyy = self.derivatives(places).T
        one, zero = np.ones_like(zx), np.zeros_like(zx)
        normals = np.stack([-zx, -zy, one], axis=1)
        steep = np.linalg.norm(normals, axis=1)
        normals /= steep[:, None]
        first = np.stack([one, zero, zx], axis=1)
        first /= np.linalg.norm(first, axis=1)[:, None]
        second = np.cross(normals, first)

        def bend(a: Floats, b: Floats) -> Floats:
            crossed = a[:, 0] * b[:, 1] + a[:, 1] * b[:, 0]
            return np.asarray((zxx * a[:, 0] * b[:, 0] + zxy * crossed + zyy * a[:, 1] * b[:, 1]) / steep)

        curvatures = np.stack([bend(first, first), bend(first, second), bend(second, second)], axis=1)
        return self.points(places), np.stack([first, second], axis=1), normals, curvatures


def fit_surface(points: Floats, low: Floats, high: Floats, *, stiffness: float) -> HeightField:
    """The surface through points (n, 3) mm over the rectangle from low (2,) to high (2,), of a stiffness in mm²."""
    shape, origin = _grid(low, high)
    bending = _bending(shape)
    design = _design(points[:, :2], origin, STEP_MM, shape)
    weights, flat = np.ones(len(points)), np.zeros(shape[0] * shape[1])
    for _ in range(REWEIGHTINGS):
        gram = design.T @ sparse.diags(weights) @ design + stiffness / STEP_MM**2 * bending
        flat = splu(gram.tocsc()).solve(design.T @ (weights * points[:, 2]))
        surface = HeightField(origin, STEP_MM, flat.reshape(shape))
        slopes = surface.derivatives(points[:, :2])[:, :2]
        facing = 1.0 / (1.0 + (slopes**2).sum(axis=1))  # squared cosine: distances are along the normal
        distance = (design @ flat - points[:, 2]) * np.sqrt(facing)
        sigma = max(robust_sigma(distance), LEAST_SIGMA_MM)
        weights = facing / (1.0 + (distance / (CAUCHY * sigma)) ** 2)
    return HeightField(origin, STEP_MM, flat.reshape(shape))


def choose_stiffness(points: Floats, low: Floats, high: Floats) -> float:
    """The stiffness, mm², with which a surface through most of the points (n, 3) mm comes nearest to the others."""
    held = np.random.default_rng(SEED).random(len(points)) < HELD_OUT
    if not held.any() or held.all():
        return STIFFNESSES[0]
    best, least = STIFFNESSES[0], np.inf
    for stiffness in STIFFNESSES:
        surface = fit_surface(points[~held], low, high, stiffness=stiffness)
        error = robust_sigma(surface.height(points[held, :2]) - points[held, 2])
        if error < GAIN * least:
            best, least = stiffness, error
    return best


def _grid(low: Floats, high: Floats) -> tuple[tuple[int, int], Floats]:
    """Rows and columns of the coefficients over a rectangle, and the first knot."""
    cols, rows = (np.ceil((np.asarray(high) - low) / STEP_MM).astype(int) + 1 + 2 * BORDER).tolist()
    return (rows, cols), np.asarray(low) - BORDER * STEP_MM


def _basis(share: Floats, order: int) -> Floats:
    """(n, 4) the cubic B-splines that are not zero at a share (n,) of a knot's interval, or a derivative of them."""
    t = share
    if order == 0:
        terms = [(1 - t) ** 3 / 6, (3 * t**3 - 6 * t**2 + 4) / 6, (-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6, t**3 / 6]
    elif order == 1:
        terms = [-((1 - t) ** 2) / 2, (3 * t**2 - 4 * t) / 2, (-3 * t**2 + 2 * t + 1) / 2, t**2 / 2]
    else:
        terms = [1 - t, 3 * t - 2, 1 - 3 * t, t]
    return np.stack(terms, axis=1)


def _design(
    places: Floats, low: Floats, step: float, shape: tuple[int, ...], order: tuple[int, int] = (0, 0)
) -> sparse.csr_matrix:
    """(n, rows · cols) what each coefficient gives to the height at places (n, 2), or to a derivative by x and y."""
    scaled = (np.asarray(places) - low) / step
    cell = np.clip(np.floor(scaled).astype(np.int64), 1, np.array(shape[::-1]) - 3)
    share = scaled - cell
    across, down = _basis(share[:, 0], order[0]), _basis(share[:, 1], order[1])
    values = (down[:, :, None] * across[:, None, :]) / step ** sum(order)
    offsets = np.arange(-1, 3)
    columns: Ints = (cell[:, 1, None, None] + offsets[:, None]) * shape[1] + cell[:, 0, None, None] + offsets
    rows = np.repeat(np.arange(len(scaled)), 16)
    return sparse.csr_matrix((values.ravel(), (rows, columns.ravel())), (len(scaled), shape[0] * shape[1]))


def _bending(shape: tuple[int, int]) -> sparse.csr_matrix:
    """The quadratic form of the thin plate's energy over the knots' cells, in heights, times a step squared."""
    rows, cols = shape

    def differences(count: int, order: int) -> sparse.csr_matrix:
        kernel = {1: [-1.0, 1.0], 2: [1.0, -2.0, 1.0]}[order]
        return sparse.diags(kernel, range(order + 1), (count - order, count))

    along = sparse.kron(sparse.eye(rows), differences(cols, 2))
    down = sparse.kron(differences(rows, 2), sparse.eye(cols))
    mixed = np.sqrt(2.0) * sparse.kron(differences(rows, 1), differences(cols, 1))
    form = sparse.vstack([along, down, mixed]).tocsr()
    return (form.T @ form).tocsr()
