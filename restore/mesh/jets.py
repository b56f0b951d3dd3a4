"""Robust quadratic patches (jets) round every vertex of a mesh.

Source: Cazals & Pouget 2005. A vertex next to a crease takes the side it lies on: the fit starts from the plane of that
    one of its own faces which most of its neighbours agree with, and points that stand off lose their weight
    (iteratively reweighted least squares).
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numba
import numpy as np

from restore.mesh.adjacency import Adjacency, faces_around, neighbours_of
from restore.mesh.measures import face_normals, face_signs, norms
from restore.numerics.limits import SQUARE_TINY, overflows_silently
from restore.numerics.robust import SIGNIFICANT
from restore.scan import Floats, Ints

MAX_NEIGHBOURS = 32  # two rings have 18 on average; of more the nearest count, whatever numbers they have
MAX_FOUND = MAX_NEIGHBOURS * MAX_NEIGHBOURS  # among which those are looked for
STAND_OFF = 0.03  # slope, 2°: neighbours that stand off a plane or a patch by more have a quarter of their weight
ROUNDS = 3  # of iterations that settle at once: reweighting, and Newton's method over a crease
PRIOR = 1e-2  # of one neighbour's weight: holds slopes and curvatures that too few neighbours leave open near zero
TERMS = 6  # height, two slopes, three second derivatives


class Jets(NamedTuple):
    """Quadratic patches of vertices.

    normals: (n, 3).
    offsets: (n,) mm, from the vertex along the normal to the patch.
    forms: (n, 3, 3) 1/mm, second fundamental forms: the value for a unit vector along the surface is the normal
        curvature there.
    """

    normals: Floats
    offsets: Floats
    forms: Floats


class Rings(NamedTuple):
    """Neighbours and faces of every vertex, and the unit normals (m, 3).

    The normals are those of all faces.
    """

    neighbours: Adjacency
    around: Adjacency
    planes: Floats


@overflows_silently
def rings_of(vertices: Floats, faces: Ints, edges: Ints) -> Rings:
    """The rings of vertices (n, 3) with faces (m, 3) and edges (e, 2)."""
    count, planes = len(vertices), face_normals(vertices, faces)
    upright = face_signs(vertices, faces) / np.maximum(norms(planes), SQUARE_TINY)
    planes *= upright[:, None]
    return Rings(neighbours_of(edges, count), faces_around(faces, count), planes)


def fit_jets(vertices: Floats, rings: Rings, chosen: Ints, noise: float, known_noise: float = 0.0) -> Jets:
    """Fit patches at the chosen vertices.

    vertices: (n, 3) mm.
    chosen: (k,); the others get no patch, and normals of zero.
    noise: mm, standard deviation of the distance of a patch from its own vertex.
    known_noise: mm, assumed noise of the neighbours, below which the robust weights make no difference.
    """
    return Jets(*_fit_all(vertices, *rings, chosen, noise, known_noise))


@numba.njit(cache=True, error_model="numpy")
def _fit_all(
    vertices: Floats,
    neighbours: Adjacency,
    around: Adjacency,
    planes: Floats,
    chosen: Ints,
    noise: float,
    known_noise: float,
) -> tuple[Floats, Floats, Floats]:
    count = len(vertices)
    normals, offsets, forms = np.zeros((count, 3)), np.zeros(count), np.zeros((count, 3, 3))
    met, found, weights = np.full(count, -1), np.empty(MAX_FOUND, np.int64), np.empty(MAX_NEIGHBOURS)
    points, nearness = np.empty((3, MAX_NEIGHBOURS)), np.empty(MAX_NEIGHBOURS)
    jet, frame, sums = np.empty(TERMS), np.eye(3), np.empty(row_of(TERMS) + TERMS)
    products = np.empty((MAX_NEIGHBOURS, len(sums)))  # of the terms with each other and with the height
    for i in chosen:
        near, far = _two_rings(i, neighbours, met, found)
        if far > MAX_NEIGHBOURS:
            near, far = _nearest(i, vertices, found, near, far), MAX_NEIGHBOURS
        if far < 3:
            continue
        reach = _weigh_neighbours(i, vertices, found, near, far, points, nearness)
        grain = known_noise / reach
        _set_frame(planes[_own_face(i, around, planes, points, nearness, far, weights, grain)], frame)
        _turn(points, far, frame)
        own = 1.0 + (STAND_OFF * reach / max(SIGNIFICANT * noise, SQUARE_TINY)) ** 2
        _fit(points, nearness, far, products, weights, own, sums, jet, grain)
        steep = 1.0 / sqrt(1.0 + jet[1] ** 2 + jet[2] ** 2)
        offsets[i] = steep * jet[0] * reach
        for p in range(3):
            normals[i, p] = steep * (frame[2, p] - jet[1] * frame[0, p] - jet[2] * frame[1, p])
            for q in range(3):
                across = frame[0, p] * frame[1, q] + frame[1, p] * frame[0, q]
                second = jet[3] * frame[0, p] * frame[0, q] + jet[4] * across + jet[5] * frame[1, p] * frame[1, q]
                forms[i, p, q] = steep * second / reach
    return normals, offsets, forms


@numba.njit(cache=True, error_model="numpy", inline="always")
def _two_rings(i: int, neighbours: Adjacency, met: Ints, found: Ints) -> tuple[int, int]:
    """Write the neighbours of vertex i and then theirs.

    met: (n,), the vertex at which each was found last.
    Returns how many neighbours there are, and how many of both.
    """
    count, met[i] = 0, i
    for q in range(neighbours.start[i], min(neighbours.start[i + 1], neighbours.start[i] + MAX_FOUND)):
        found[count], met[neighbours.items[q]] = neighbours.items[q], i
        count += 1
    near = count
    for f in range(near):
        for q in range(neighbours.start[found[f]], neighbours.start[found[f] + 1]):
            k = neighbours.items[q]
            if met[k] != i and count < MAX_FOUND:
                found[count], met[k] = k, i
                count += 1
    return near, count


@numba.njit(cache=True, error_model="numpy")
def _nearest(i: int, vertices: Floats, found: Ints, near: int, far: int) -> int:
    """Put the MAX_NEIGHBOURS nearest of vertex i first.

    Those of the first ring come before others.
    found: (·,), `near` neighbours, and theirs up to `far`.
    Returns how many of the first ring are left.
    """
    first, last = (0, near) if near > MAX_NEIGHBOURS else (near, far)
    away = np.zeros(last - first)
    for k in range(first, last):
        for axis in range(3):
            away[k - first] += (vertices[found[k], axis] - vertices[i, axis]) ** 2
    found[first:last] = found[first:last][np.argsort(away)]
    return min(near, MAX_NEIGHBOURS)


@numba.njit(cache=True, error_model="numpy", inline="always")
def _weigh_neighbours(
    i: int, vertices: Floats, found: Ints, near: int, far: int, points: Floats, nearness: Floats
) -> float:
    """Write the offsets and nearness of the neighbours of vertex i.

    Nearness is 1 / distance, in units of the mean distance of the first `near` of them, which is returned in mm.
    """
    reach = SQUARE_TINY
    for k in range(far):
        for axis in range(3):
            points[axis, k] = vertices[found[k], axis] - vertices[i, axis]
    for k in range(far):
        nearness[k] = sqrt(points[0, k] ** 2 + points[1, k] ** 2 + points[2, k] ** 2) + SQUARE_TINY
    for k in range(near):
        reach += nearness[k] / near
    for k in range(far):
        nearness[k] = reach / nearness[k]
        for axis in range(3):
            points[axis, k] *= 1.0 / reach
    return reach


@numba.njit(cache=True, error_model="numpy", fastmath={"reassoc", "nsz"})
def _own_face(
    i: int, around: Adjacency, planes: Floats, points: Floats, nearness: Floats, far: int, weights: Floats, grain: float
) -> int:
    """Return the face at vertex i whose plane fits its neighbours best.

    The weights are written for the neighbours that agree.
    """
    least, own = np.inf, around.items[around.start[i]]
    for q in range(around.start[i], around.start[i + 1]):
        face, against = around.items[q], 0.0
        for k in range(far):
            squared = _squared_slope(planes, face, points, nearness, k, grain)
            against += squared / (1.0 + squared)
        if against < least:
            least, own = against, face
    for k in range(far):
        weights[k] = 1.0 / (1.0 + _squared_slope(planes, own, points, nearness, k, grain)) ** 2
    return own


@numba.njit(cache=True, error_model="numpy", fastmath={"reassoc", "nsz"})
def _squared_slope(planes: Floats, face: int, points: Floats, nearness: Floats, k: int, grain: float) -> float:
    """Return the squared slope of neighbour k from a face's plane, in STAND_OFF and noise."""
    off = planes[face, 0] * points[0, k] + planes[face, 1] * points[1, k] + planes[face, 2] * points[2, k]
    return _squared(off, nearness[k], grain)


@numba.njit(cache=True, error_model="numpy", inline="always")
def _squared(off: float, nearness: float, grain: float) -> float:
    """Return a squared height off a plane or a patch, in units of its scale.

    The scale is a slope of STAND_OFF, and the noise.
    """
    return off**2 / ((STAND_OFF / nearness) ** 2 + (SIGNIFICANT * grain) ** 2)


@numba.njit(cache=True, error_model="numpy", inline="always")
def _set_frame(normal: Floats, frame: Floats) -> None:
    """Write rows: two directions along the plane of a normal (3,), and the normal."""
    axis = 0 if abs(normal[0]) < 0.6 else 1
    length = sqrt(1.0 - normal[axis] ** 2)
    for k in range(3):
        frame[2, k] = normal[k]
        frame[0, k] = ((1.0 if k == axis else 0.0) - normal[axis] * normal[k]) / length
    for k in range(3):
        m, n = (k + 1) % 3, (k + 2) % 3
        frame[1, k] = frame[2, m] * frame[0, n] - frame[2, n] * frame[0, m]


@numba.njit(cache=True, error_model="numpy", inline="always")
def _turn(points: Floats, far: int, frame: Floats) -> None:
    for k in range(far):
        x, y, z = points[0, k], points[1, k], points[2, k]
        for row in range(3):
            points[row, k] = frame[row, 0] * x + frame[row, 1] * y + frame[row, 2] * z


@numba.njit(cache=True, error_model="numpy", inline="always")
def _fit(
    points: Floats,
    nearness: Floats,
    far: int,
    products: Floats,
    weights: Floats,
    own: float,
    sums: Floats,
    jet: Floats,
    grain: float,
) -> None:
    """Write height, slopes and second derivatives of a fitted patch.

    It passes points (3, far) and, with weight own, the origin.
    products: (·, p), of the terms with each other and with the height; overwritten, as are their sums (p,).
    """
    for k in range(far):
        _multiply(points, k, products)
    for _ in range(ROUNDS):
        sums[:] = 0.0
        for p in range(1, TERMS):
            sums[row_of(p) + p] = PRIOR
        sums[row_of(4) + 4] *= 2.0  # the mixed derivative counts twice in a form
        sums[row_of(0)] = own
        for k in range(far):
            for m in range(len(sums)):
                sums[m] += weights[k] * products[k, m]
        _solve(sums, jet)
        _weigh(points, nearness, far, jet, weights, grain)


@numba.njit(cache=True, error_model="numpy", fastmath={"reassoc", "nsz"})
def _weigh(points: Floats, nearness: Floats, far: int, jet: Floats, weights: Floats, grain: float) -> None:
    """Write what say each point has, less where it stands off the patch."""
    for k in range(far):
        x, y = points[0, k], points[1, k]
        off = points[2, k] - jet[0] - (jet[1] + 0.5 * jet[3] * x) * x - (jet[2] + jet[4] * x + 0.5 * jet[5] * y) * y
        weights[k] = 1.0 / (1.0 + _squared(off, nearness[k], grain)) ** 2


@numba.njit(cache=True, error_model="numpy")
def row_of(p: int) -> int:
    """Where row p begins in a triangle that is stored row by row."""
    return p * (p + 1) // 2


@numba.njit(cache=True, error_model="numpy")
def _multiply(points: Floats, k: int, products: Floats) -> None:
    """Write the products of the terms at point k, lower triangle by rows, and with height."""
    x, y, z = points[0, k], points[1, k], points[2, k]
    for p, term in enumerate((1.0, x, y, 0.5 * x * x, x * y, 0.5 * y * y)):
        row = row_of(p)
        products[k, row], products[k, row_of(TERMS) + p] = term, term * z
        for q in range(1, p + 1):
            products[k, row + q] = term * products[k, row_of(q)]


@numba.njit(cache=True, error_model="numpy")
def _solve(triangle: Floats, found: Floats) -> None:
    """Solve a symmetric positive definite system by Cholesky's method.

    triangle (p,) is its lower half row by row, with the right side as one row more; it is written over.
    """
    for p in range(TERMS + 1):
        row = row_of(p)
        for q in range(min(p + 1, TERMS)):
            col, rest = row_of(q), triangle[row + q]
            for k in range(q):
                rest -= triangle[row + k] * triangle[col + k]
            # The diagonal is kept as what the others are multiplied by.
            triangle[row + q] = rest * triangle[col + q] if q < p else 1.0 / sqrt(max(rest, SQUARE_TINY))
    for p in range(TERMS - 1, -1, -1):
        rest = triangle[row_of(TERMS) + p]
        for k in range(p + 1, TERMS):
            rest -= triangle[row_of(k) + p] * found[k]
        found[p] = rest * triangle[row_of(p) + p]
