"""A patch of smooth surface round every vertex of a mesh: robust quadratic fits (jets, Cazals & Pouget 2005).

A vertex beside a crease takes the side it lies on: the fit starts from the plane of that one of its own faces which
most of its neighbours agree with, and points that stand off lose their say (iteratively reweighted least squares).
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numba
import numpy as np

from restore.flatten.adjacency import Adjacency, adjacency
from restore.scan import Floats, Ints

MOST_NEIGHBOURS = 32  # two rings have 18 on average
ON_PLANE = 0.1  # slope, 6°: neighbours that stand off a face by more count half against it
ON_PATCH = 0.03  # slope: neighbours that stand off the patch by more have a quarter of their weight
ROUNDS = 3  # of reweighting
GRADIENT_PRIOR, CURVATURE_PRIOR = 1e-3, 1e-2  # hold what few neighbours leave open near zero
TERMS = 6  # height, two slopes, three second derivatives
MOST_TIED = 1e9  # weight of its own vertex in a patch of a surface without noise
TINY = 1e-30


class Jets(NamedTuple):
    """Of every vertex: normals (n, 3), offsets (n,) mm from it along the normal to the patch, forms (n, 3, 3) 1/mm.

    A form is the second fundamental form: its value for a unit vector along the surface is the normal curvature there.
    """

    normals: Floats
    offsets: Floats
    forms: Floats


class Rings(NamedTuple):
    """What lies round every vertex of a mesh: its neighbours, its faces, and the unit normals (m, 3) of all faces."""

    neighbours: Adjacency
    around: Adjacency
    planes: Floats


def rings_of(vertices: Floats, faces: Ints, edges: Ints) -> Rings:
    """The rings of vertices (n, 3) with faces (m, 3) and edges (e, 2)."""
    count = len(vertices)
    neighbours = adjacency(edges.ravel(), edges[:, ::-1].ravel(), count)
    around = adjacency(faces.ravel(), np.repeat(np.arange(len(faces)), 3), count)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    planes = np.cross(b - a, c - a)
    return Rings(neighbours, around, planes / np.maximum(np.linalg.norm(planes, axis=1), TINY)[:, None])


def fit_jets(vertices: Floats, rings: Rings, chosen: Ints, noise: float) -> Jets:
    """Fit patches at the chosen (k,) of vertices (n, 3) mm; the others get none, and normals of zero.

    noise (mm, standard deviation) tells how far a patch may pass by its own vertex.
    """
    return Jets(*_fit_all(vertices, *rings, chosen, noise))


@numba.njit(cache=True)
def _fit_all(
    vertices: Floats, neighbours: Adjacency, around: Adjacency, planes: Floats, chosen: Ints, noise: float
) -> tuple[Floats, Floats, Floats]:
    count = len(vertices)
    normals, offsets, forms = np.zeros((count, 3)), np.zeros(count), np.zeros((count, 3, 3))
    found, weights = np.empty(MOST_NEIGHBOURS, np.int64), np.empty(MOST_NEIGHBOURS)
    points, distances = np.empty((MOST_NEIGHBOURS, 3)), np.empty(MOST_NEIGHBOURS)
    terms, matrix, jet, frame = np.empty((MOST_NEIGHBOURS, TERMS)), np.empty((TERMS, TERMS)), np.empty(TERMS), np.eye(3)
    for i in chosen:
        near, far = _two_rings(i, neighbours, found)
        if far < 3:
            continue
        reach = _beside(i, vertices, found, near, far, points, distances)
        _set_frame(planes[_own_face(i, around, planes, points, distances, far, weights)], frame)
        _turn(points, far, frame)
        own = min(1.0 + (ON_PATCH * reach / max(3.0 * noise, TINY)) ** 2, MOST_TIED)
        _fit(points, distances, far, terms, weights, own, matrix, jet)
        steep = 1.0 / sqrt(1.0 + jet[1] ** 2 + jet[2] ** 2)
        offsets[i] = steep * jet[0] * reach
        for p in range(3):
            normals[i, p] = steep * (frame[2, p] - jet[1] * frame[0, p] - jet[2] * frame[1, p])
            for q in range(3):
                across = frame[0, p] * frame[1, q] + frame[1, p] * frame[0, q]
                second = jet[3] * frame[0, p] * frame[0, q] + jet[4] * across + jet[5] * frame[1, p] * frame[1, q]
                forms[i, p, q] = steep * second / reach
    return normals, offsets, forms


@numba.njit(cache=True)
def _two_rings(i: int, neighbours: Adjacency, found: Ints) -> tuple[int, int]:
    """Write the neighbours of vertex i and then theirs; how many neighbours there are, and how many of both."""
    count = 0
    for q in range(neighbours.start[i], min(neighbours.start[i + 1], neighbours.start[i] + MOST_NEIGHBOURS)):
        found[count] = neighbours.items[q]
        count += 1
    near = count
    for f in range(near):
        for q in range(neighbours.start[found[f]], neighbours.start[found[f] + 1]):
            k, new = neighbours.items[q], count < MOST_NEIGHBOURS
            for m in range(count):
                new = new and found[m] != k
            if new and k != i:
                found[count] = k
                count += 1
    return near, count


@numba.njit(cache=True)
def _beside(i: int, vertices: Floats, found: Ints, near: int, far: int, points: Floats, distances: Floats) -> float:
    """Write where the neighbours lie from vertex i, in units of their mean distance, which is returned in mm."""
    reach = TINY
    for k in range(far):
        squared = 0.0
        for axis in range(3):
            points[k, axis] = vertices[found[k], axis] - vertices[i, axis]
            squared += points[k, axis] ** 2
        distances[k] = sqrt(squared) + TINY
        if k < near:
            reach += distances[k] / near
    for k in range(far):
        distances[k] /= reach
        for axis in range(3):
            points[k, axis] /= reach
    return reach


@numba.njit(cache=True)
def _own_face(
    i: int, around: Adjacency, planes: Floats, points: Floats, distances: Floats, far: int, weights: Floats
) -> int:
    """That face at vertex i whose plane agrees best with its neighbours; the weights tell which of them agree."""
    least, own = np.inf, around.items[around.start[i]]
    for q in range(around.start[i], around.start[i + 1]):
        face, against = around.items[q], 0.0
        for k in range(far):
            squared = _squared_slope(planes, face, points, distances, k)
            against += squared / (1.0 + squared)
        if against < least:
            least, own = against, face
    for k in range(far):
        weights[k] = 1.0 / (1.0 + _squared_slope(planes, own, points, distances, k)) ** 2
    return own


@numba.njit(cache=True)
def _squared_slope(planes: Floats, face: int, points: Floats, distances: Floats, k: int) -> float:
    """How steeply neighbour k stands off the plane of a face, squared, in units of ON_PLANE."""
    off = planes[face, 0] * points[k, 0] + planes[face, 1] * points[k, 1] + planes[face, 2] * points[k, 2]
    return (off / (ON_PLANE * distances[k])) ** 2


@numba.njit(cache=True)
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


@numba.njit(cache=True)
def _turn(points: Floats, far: int, frame: Floats) -> None:
    for k in range(far):
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        for row in range(3):
            points[k, row] = frame[row, 0] * x + frame[row, 1] * y + frame[row, 2] * z


@numba.njit(cache=True)
def _fit(
    points: Floats,
    distances: Floats,
    far: int,
    terms: Floats,
    weights: Floats,
    own: float,
    matrix: Floats,
    jet: Floats,
) -> None:
    """Write height, slopes and second derivatives of a patch through points (far, 3) and, weighing own, the origin."""
    for k in range(far):
        x, y = points[k, 0], points[k, 1]
        terms[k, 0], terms[k, 1], terms[k, 2] = 1.0, x, y
        terms[k, 3], terms[k, 4], terms[k, 5] = 0.5 * x * x, x * y, 0.5 * y * y
    for _ in range(ROUNDS):
        for p in range(TERMS):
            jet[p] = 0.0
            for q in range(p):
                matrix[p, q] = 0.0
            matrix[p, p] = own if p == 0 else GRADIENT_PRIOR if p < 3 else CURVATURE_PRIOR
        for k in range(far):
            for p in range(TERMS):
                share = weights[k] * terms[k, p]
                jet[p] += share * points[k, 2]
                for q in range(p + 1):
                    matrix[p, q] += share * terms[k, q]
        _solve(matrix, jet)
        for k in range(far):
            off = points[k, 2]
            for p in range(TERMS):
                off -= terms[k, p] * jet[p]
            weights[k] = 1.0 / (1.0 + (off / (ON_PATCH * distances[k])) ** 2) ** 2


@numba.njit(cache=True)
def _solve(matrix: Floats, right: Floats) -> None:
    """Solve a symmetric positive definite system in place by Cholesky's method; the lower triangle is read."""
    for row in range(len(right)):
        for col in range(row + 1):
            rest = matrix[row, col]
            for k in range(col):
                rest -= matrix[row, k] * matrix[col, k]
            matrix[row, col] = rest / matrix[col, col] if col < row else sqrt(max(rest, TINY))
    for row in range(len(right)):
        for k in range(row):
            right[row] -= matrix[row, k] * right[k]
        right[row] /= matrix[row, row]
    for row in range(len(right) - 1, -1, -1):
        for k in range(row + 1, len(right)):
            right[row] -= matrix[k, row] * right[k]
        right[row] /= matrix[row, row]
