"""Bundle adjustment of many points and few views of one lens.

Gauss–Newton with damping on the reduced camera system (Triggs et al., "Bundle adjustment: a modern synthesis", 2000,
§6.1): the points are eliminated, and of the cameras there are so few that the rest is dense. Errors are weighted as
Cauchy's distribution has them. The focal length and the principal point of a view may depart a little from the lens's,
as focus breathing and stabilisation have it; a prior keeps them near.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numba
import numpy as np

from restore.camera.photo_camera import PhotoCamera
from restore.numerics.robust import robust_sigma
from restore.scan import Floats, Ints

OWN = 9  # unknowns of a view: rotation 3, translation 3, focal length as a logarithm, principal point 2
SHARED = 8  # of the lens: focal length as a logarithm, principal point 2, k1, k2, p1, p2, k3
BREATHING = 5e-4  # standard deviation of a view's focal length about the lens's, relative: autofocus on one page
SHIFTING = 5e-4  # of its principal point, in widths of the picture
K3_PRIOR = 0.1  # lenses other than fisheyes have no more; without, k3 and k2 run away together
ITERATIONS = 12
SETTLED = 1e-5  # relative gain of a step
ROUGHLY = 1e-3  # the same where the cameras are adjusted again: eight steps instead of twelve
DAMPING = 1e-4  # of the diagonal at first; also what holds the frame and scale, which the pictures leave open
CAUCHY = 2.5  # standard deviations at which an error has half the weight


@dataclass(frozen=True, eq=False)
class Tracks:
    """Where points are seen.

    view, point  (m,) index of the view and of the point of each observation.
    pixels       (m, 2).
    sigma        (m,) standard deviation of each, pixels, up to a common factor.
    """

    view: Ints
    point: Ints
    pixels: Floats
    sigma: Floats


@dataclass(frozen=True, eq=False)
class Adjusted:
    """Result of an adjustment.

    cameras: after it.
    points: (n, 3), after it.
    residuals: (m, 2) pixels.
    sigma0: the common factor of their standard deviations.
    """

    cameras: list[PhotoCamera]
    points: Floats
    residuals: Floats
    sigma0: float


@dataclass(frozen=True, eq=False)
class _State:
    rotations: Floats  # (v, 3, 3)
    shifts: Floats  # (v, 3)
    own: Floats  # (v, 3) departures of the log focal length and the principal point
    lens: Floats  # (8,) log focal length, principal point, k1, k2, p1, p2, k3
    points: Floats  # (n, 3)

    def lenses(self) -> Floats:
        """Return the lens (v, 8) of each view."""
        lenses = np.tile(self.lens, (len(self.own), 1))
        lenses[:, :3] += self.own
        return lenses

    def moved(self, step: Floats, points: Floats) -> _State:
        """The state after a step (9 v + 8,) of the cameras and (n, 3) of the points."""
        views = len(self.own)
        own = step[: OWN * views].reshape(views, OWN)
        turns = np.stack([cv2.Rodrigues(turn)[0] for turn in own[:, :3]])
        return _State(
            turns @ self.rotations,
            self.shifts + own[:, 3:6],
            self.own + own[:, 6:],
            self.lens + step[OWN * views :],
            self.points + points,
        )


def adjust(
    cameras: Sequence[PhotoCamera],
    points: Floats,
    tracks: Tracks,
    *,
    breathing: float = BREATHING,
    shifting: float = SHIFTING,
    settled: float = SETTLED,
) -> Adjusted:
    """Adjust cameras of one lens and points (n, 3) to their tracks.

    Points without observations stay as they are.
    breathing: standard deviation of a view's focal length about the lens's, relative.
    shifting: that of its principal point, in widths of the picture.
    settled: the relative gain of a step at which it ends.
    """
    state = _start(cameras, points)
    width = cameras[0].size[0]
    prior = np.concatenate([np.zeros(6), [breathing**-2, (shifting * width) ** -2, (shifting * width) ** -2]])
    damping, residuals = DAMPING, _residuals(state, tracks)
    sigma0 = _sigma0(residuals, tracks)
    cost = _cost(state, residuals, tracks, sigma0, prior)
    for _ in range(ITERATIONS):
        step = _step(state, residuals, tracks, sigma0, prior, damping)
        moved = state.moved(*step)
        after = _residuals(moved, tracks)
        gain = cost - _cost(moved, after, tracks, sigma0, prior)
        if not gain > 0:
            damping *= 10
            continue
        last = gain < settled * cost
        state, residuals, damping = moved, after, damping / 5
        sigma0 = _sigma0(residuals, tracks)
        cost = _cost(state, residuals, tracks, sigma0, prior)
        if last:
            break
    return Adjusted(_cameras(state, cameras[0].size), state.points, residuals, sigma0)


def _start(cameras: Sequence[PhotoCamera], points: Floats) -> _State:
    vectors = np.stack([camera.vector for camera in cameras])
    lenses = vectors[:, 6:].copy()
    lenses[:, 0] = np.log(lenses[:, 0])
    lens = lenses.mean(axis=0)
    rotations = np.stack([camera.rotation for camera in cameras])
    return _State(rotations, vectors[:, 3:6].copy(), (lenses - lens)[:, :3], lens, points.copy())


def _cameras(state: _State, size: tuple[int, int]) -> list[PhotoCamera]:
    lenses = state.lenses()
    lenses[:, 0] = np.exp(lenses[:, 0])
    turns = [cv2.Rodrigues(rotation)[0].ravel() for rotation in state.rotations]
    rows = zip(turns, state.shifts, lenses, strict=True)
    return [PhotoCamera(np.concatenate(row), size) for row in rows]


def _residuals(state: _State, tracks: Tracks) -> Floats:
    return _project(
        state.rotations, state.shifts, state.lenses(), state.points, tracks.view, tracks.point, tracks.pixels
    )


def _sigma0(residuals: Floats, tracks: Tracks) -> float:
    return robust_sigma((residuals / tracks.sigma[:, None]).ravel())


def _cost(state: _State, residuals: Floats, tracks: Tracks, sigma0: float, prior: Floats) -> float:
    squared = (residuals**2).sum(axis=1) / (tracks.sigma * sigma0 * CAUCHY) ** 2
    return float(
        CAUCHY**2 * np.log1p(squared).sum() + (prior[6:] * state.own**2).sum() + (state.lens[7] / K3_PRIOR) ** 2
    )


def _step(
    state: _State, residuals: Floats, tracks: Tracks, sigma0: float, prior: Floats, damping: float
) -> tuple[Floats, Floats]:
    """The damped Gauss–Newton step of the cameras (9 v + 8,) and of the points (n, 3)."""
    squared = (residuals**2).sum(axis=1) / (tracks.sigma * sigma0 * CAUCHY) ** 2
    weights = 1.0 / ((tracks.sigma * sigma0) ** 2 * (1.0 + squared))
    cameras, crossed, points, camera_side, point_side = _normal_equations(
        state.rotations, state.shifts, state.lenses(), state.points, tracks.view, tracks.point, residuals, weights
    )
    views = len(state.own)
    diagonal = np.concatenate([np.tile(prior, views), np.zeros(SHARED - 1), [K3_PRIOR**-2]])
    cameras[np.diag_indices_from(cameras)] += diagonal
    known = np.concatenate([np.column_stack([np.zeros((views, 6)), state.own]).ravel(), np.zeros(7), state.lens[7:]])
    camera_side -= diagonal * known
    cameras[np.diag_indices_from(cameras)] *= 1.0 + damping
    points[:, np.arange(3), np.arange(3)] *= 1.0 + damping
    seen = points[:, 0, 0] > 0
    points[~seen] = np.eye(3)
    inverse = np.linalg.inv(points)
    _eliminate_points(cameras, camera_side, crossed, inverse, point_side)
    # Rotations and millimetres differ by orders of magnitude: scaled, the system is well conditioned.
    scale = 1.0 / np.sqrt(np.maximum(np.diag(cameras), 1e-12))
    step = scale * np.linalg.lstsq(cameras * scale * scale[:, None], camera_side * scale, rcond=1e-13)[0]
    move = np.einsum("nij,nj->ni", inverse, point_side - np.einsum("nkc,c->nk", crossed, step))
    return step, np.where(seen[:, None], move, 0.0)


@numba.njit(cache=True)
def _project(
    rotations: Floats, shifts: Floats, lenses: Floats, points: Floats, view: Ints, point: Ints, pixels: Floats
) -> Floats:
    """Return measured less projected pixels, (m, 2)."""
    out = np.empty((len(view), 2))
    for m in range(len(view)):
        v, p = view[m], points[point[m]]
        turn, lens = rotations[v], lenses[v]
        z = turn[2, 0] * p[0] + turn[2, 1] * p[1] + turn[2, 2] * p[2] + shifts[v, 2]
        x = (turn[0, 0] * p[0] + turn[0, 1] * p[1] + turn[0, 2] * p[2] + shifts[v, 0]) / z
        y = (turn[1, 0] * p[0] + turn[1, 1] * p[1] + turn[1, 2] * p[2] + shifts[v, 1]) / z
        r2 = x * x + y * y
        stretch = 1.0 + r2 * (lens[3] + r2 * (lens[4] + r2 * lens[7]))
        focal = np.exp(lens[0])
        out[m, 0] = pixels[m, 0] - focal * (x * stretch + 2 * lens[5] * x * y + lens[6] * (r2 + 2 * x * x)) - lens[1]
        out[m, 1] = pixels[m, 1] - focal * (y * stretch + lens[5] * (r2 + 2 * y * y) + 2 * lens[6] * x * y) - lens[2]
    return out


@numba.njit(cache=True)
def _normal_equations(
    rotations: Floats,
    shifts: Floats,
    lenses: Floats,
    points: Floats,
    view: Ints,
    point: Ints,
    residuals: Floats,
    weights: Floats,
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Return the blocks of the normal equations.

    Cameras (c, c), points with cameras (n, 3, c), points (n, 3, 3), and the right sides (c,) and (n, 3).
    """
    views = len(shifts)
    count = OWN * views + SHARED
    cameras, crossed = np.zeros((count, count)), np.zeros((len(points), 3, count))
    blocks = np.zeros((len(points), 3, 3))
    camera_side, point_side = np.zeros(count), np.zeros((len(points), 3))
    columns = np.empty(OWN + SHARED, np.int64)
    by_camera, by_point = np.empty((2, OWN + SHARED)), np.empty((2, 3))
    for m in range(len(view)):
        v, i, w = view[m], point[m], weights[m]
        _derivatives(rotations[v], shifts[v], lenses[v], points[i], by_camera, by_point)
        for k in range(OWN):
            columns[k] = OWN * v + k
        for k in range(SHARED):
            columns[OWN + k] = OWN * views + k
        for row in range(2):
            e = residuals[m, row]
            for j in range(OWN + SHARED):
                a = w * by_camera[row, j]
                camera_side[columns[j]] += a * e
                for k in range(OWN + SHARED):
                    cameras[columns[j], columns[k]] += a * by_camera[row, k]
                for k in range(3):
                    crossed[i, k, columns[j]] += a * by_point[row, k]
            for j in range(3):
                a = w * by_point[row, j]
                point_side[i, j] += a * e
                for k in range(3):
                    blocks[i, j, k] += a * by_point[row, k]
    return cameras, crossed, blocks, camera_side, point_side


@numba.njit(cache=True, nogil=True)
def _eliminate_points(cameras: Floats, side: Floats, crossed: Floats, inverse: Floats, point_side: Floats) -> None:
    """Eliminate the points from the equations of the cameras, in place.

    Compiled here: the threads of a matrix product wait for each other longer than one of them takes.
    cameras, side: (c, c) and (c,).
    crossed: (n, 3, c).
    inverse: (n, 3, 3), of the points' blocks.
    point_side: (n, 3).
    """
    count = len(side)
    moves = np.empty((count, 3))  # of a point for a unit of each unknown
    for i in range(len(crossed)):
        x, y, z = crossed[i, 0], crossed[i, 1], crossed[i, 2]
        for a in range(count):
            for k in range(3):
                moves[a, k] = inverse[i, k, 0] * x[a] + inverse[i, k, 1] * y[a] + inverse[i, k, 2] * z[a]
        for a in range(count):
            p, q, r = moves[a]
            if p == 0.0 and q == 0.0 and r == 0.0:
                continue
            side[a] -= p * point_side[i, 0] + q * point_side[i, 1] + r * point_side[i, 2]
            row = cameras[a]
            for b in range(a, count):
                row[b] -= p * x[b] + q * y[b] + r * z[b]
    for a in range(count):
        for b in range(a):
            cameras[a, b] = cameras[b, a]


@numba.njit(cache=True)
def _derivatives(turn: Floats, shift: Floats, lens: Floats, p: Floats, by_camera: Floats, by_point: Floats) -> None:
    """Write the derivatives of a projection by its camera and its point.

    by_camera: (2, 17), own unknowns first.
    by_point: (2, 3).
    """
    turned = turn @ p
    z = turned[2] + shift[2]
    x, y = (turned[0] + shift[0]) / z, (turned[1] + shift[1]) / z
    focal, k1, k2, p1, p2, k3 = np.exp(lens[0]), lens[3], lens[4], lens[5], lens[6], lens[7]
    r2 = x * x + y * y
    stretch = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    bend = k1 + r2 * (2 * k2 + 3 * r2 * k3)  # of the stretch by r²
    u = x * stretch + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * stretch + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    mixed = 2 * x * y * bend + 2 * p1 * x + 2 * p2 * y
    ux, vy = stretch + 2 * x * x * bend + 2 * p1 * y + 6 * p2 * x, stretch + 2 * y * y * bend + 6 * p1 * y + 2 * p2 * x
    for row in range(2):
        a, b = (ux, mixed) if row == 0 else (mixed, vy)
        # by the point in the camera's frame
        cx, cy, cz = focal * a / z, focal * b / z, -focal * (a * x + b * y) / z
        # rotation about the camera's axes, on the left: d(R p) = w × R p
        by_camera[row, 0] = cz * turned[1] - cy * turned[2]
        by_camera[row, 1] = cx * turned[2] - cz * turned[0]
        by_camera[row, 2] = cy * turned[0] - cx * turned[1]
        by_camera[row, 3], by_camera[row, 4], by_camera[row, 5] = cx, cy, cz
        for k in range(3):
            by_point[row, k] = cx * turn[0, k] + cy * turn[1, k] + cz * turn[2, k]
        by_camera[row, 6] = focal * (u if row == 0 else v)
        by_camera[row, 7], by_camera[row, 8] = 1.0 - row, 1.0 * row
        for k in range(3):
            by_camera[row, OWN + k] = by_camera[row, 6 + k]
        along = x if row == 0 else y
        by_camera[row, OWN + 3] = focal * along * r2
        by_camera[row, OWN + 4] = focal * along * r2 * r2
        by_camera[row, OWN + 5] = focal * (2 * x * y if row == 0 else r2 + 2 * y * y)
        by_camera[row, OWN + 6] = focal * (r2 + 2 * x * x if row == 0 else 2 * x * y)
        by_camera[row, OWN + 7] = focal * along * r2 * r2 * r2
