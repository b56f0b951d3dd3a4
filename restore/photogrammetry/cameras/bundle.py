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

from restore.camera.brown import differentiate, seen_at
from restore.camera.photo_camera import PhotoCamera
from restore.numerics.robust import CAUCHY, robust_sigma
from restore.scan import Floats, Ints

OWN = 9  # unknowns of a view: rotation 3, translation 3, focal length as a logarithm, principal point 2
LENS = 6  # where the parameters of the lens begin in a camera's vector
SHARED = 8  # of the lens: focal length as a logarithm, principal point 2, k1, k2, p1, p2, k3
PLAY = 5e-4  # of a lens: standard deviation of its focal length, relative, and of its centre, in widths, on one page
K3_PRIOR = 0.1  # lenses other than fisheyes have no more; without, k3 and k2 run away together
ITERATIONS = 12
SETTLED = 1e-5  # relative gain of a step
ROUGHLY = 1e-3  # the same where the cameras are adjusted again: eight steps instead of twelve
DAMPING = 1e-4  # of the diagonal at first; also what holds the frame and scale, which the pictures leave open


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

    def vectors(self) -> Floats:
        """Return the vector (v, 14) of each view's camera."""
        lenses = np.tile(self.lens, (len(self.own), 1))
        lenses[:, :3] += self.own
        lenses[:, 0] = np.exp(lenses[:, 0])
        turns = np.array([cv2.Rodrigues(rotation)[0].ravel() for rotation in self.rotations])
        return np.column_stack([turns, self.shifts, lenses])

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
    breathing: float = PLAY,
    shifting: float = PLAY,
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
    found = [PhotoCamera(vector, cameras[0].size) for vector in state.vectors()]
    return Adjusted(found, state.points, residuals, sigma0)


def _start(cameras: Sequence[PhotoCamera], points: Floats) -> _State:
    vectors = np.stack([camera.vector for camera in cameras])
    lenses = vectors[:, 6:].copy()
    lenses[:, 0] = np.log(lenses[:, 0])
    lens = lenses.mean(axis=0)
    rotations = np.stack([camera.rotation for camera in cameras])
    return _State(rotations, vectors[:, 3:6].copy(), (lenses - lens)[:, :3], lens, points.copy())


def _residuals(state: _State, tracks: Tracks) -> Floats:
    return _project(state.rotations, state.vectors(), state.points, tracks.view, tracks.point, tracks.pixels)


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
        state.rotations, state.vectors(), state.points, tracks.view, tracks.point, residuals, weights
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
def _project(turns: Floats, cameras: Floats, points: Floats, view: Ints, point: Ints, pixels: Floats) -> Floats:
    """Return measured less projected pixels, (m, 2)."""
    out = np.empty((len(view), 2))
    for m in range(len(view)):
        v, p = view[m], points[point[m]]
        x, y = seen_at(turns[v], cameras[v], p[0], p[1], p[2])
        out[m, 0], out[m, 1] = pixels[m, 0] - x, pixels[m, 1] - y
    return out


@numba.njit(cache=True)
def _normal_equations(
    turns: Floats, vectors: Floats, points: Floats, view: Ints, point: Ints, residuals: Floats, weights: Floats
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Return the blocks of the normal equations.

    Cameras (c, c), points with cameras (n, 3, c), points (n, 3, 3), and the right sides (c,) and (n, 3).
    """
    views = len(vectors)
    count = OWN * views + SHARED
    cameras, crossed = np.zeros((count, count)), np.zeros((len(points), 3, count))
    blocks = np.zeros((len(points), 3, 3))
    camera_side, point_side = np.zeros(count), np.zeros((len(points), 3))
    columns = np.empty(OWN + SHARED, np.int64)
    parameters = np.concatenate((np.arange(OWN), np.arange(LENS, LENS + SHARED)))
    by_camera, by_point = np.empty((2, LENS + SHARED)), np.empty((2, 3))
    for m in range(len(view)):
        v, i, w = view[m], point[m], weights[m]
        differentiate(turns[v], vectors[v], points[i], by_camera, by_point)
        by_camera[:, LENS] *= vectors[v, LENS]  # by the logarithm
        for k in range(OWN):
            columns[k] = OWN * v + k
        for k in range(SHARED):
            columns[OWN + k] = OWN * views + k
        for row in range(2):
            e = residuals[m, row]
            for j in range(OWN + SHARED):
                a = w * by_camera[row, parameters[j]]
                camera_side[columns[j]] += a * e
                for k in range(OWN + SHARED):
                    cameras[columns[j], columns[k]] += a * by_camera[row, parameters[k]]
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
