"""Distances of the vertices of a mesh along the surface they sample.

The straight edge is too short over a bend, far too short over a crease between its ends, and too long between vertices
that noise has moved. The patches round both ends give the length of the path between them.
"""

from __future__ import annotations

from math import asin, atan2, cos, sin, sqrt

import numba
import numpy as np

from restore.mesh.decimation_bias import correct_decimation_bias, stood_outside
from restore.mesh.jets import ROUNDS, Jets, Rings, fit_jets, rings_of
from restore.mesh.measures import corner_angles, straight_lengths
from restore.mesh.topology import Topology
from restore.numerics.limits import SINGLE_PRECISION, SQUARE_TINY
from restore.numerics.robust import MAD_TO_SIGMA, SIGNIFICANT, robust_sigma
from restore.scan import Floats, Ints

PROBES = 100  # vertices that determine the noise
PASSES = 5  # from patches that take noise for shape to some that know it: by then it settles
SHRUNK = 0.87  # of the noise is left between a vertex and a quadratic through it and two hexagonal rings: √(42 / 55)
ROUGHER = 2.0  # the angle defect may get when vertices are put back; faces that unfold by themselves have none
CREASE = 0.1  # radians, 6°: a turn that the curvature of both patches does not explain is a crease; without noise to
# explain how patches pass by their vertices, every such turn
LEVEL = cos(CREASE)


def surface_lengths(vertices: Floats, topology: Topology) -> Floats:
    """Return the edge lengths (e,) mm along the surface.

    vertices: (n, 3) mm, samples of the surface.
    topology: of faces (m, 3).
    """
    return straight_and_along(vertices, topology)[1]


def straight_and_along(vertices: Floats, topology: Topology) -> tuple[Floats, Floats]:
    """Return the edge lengths (e,) mm, straight and along the surface.

    Both between the points of the surface that the vertices (n, 3) mm stand for.
    topology: of faces (m, 3).
    """
    edges = topology.edges
    points, jets = _points_of_surface(vertices, topology)
    straight, bent = straight_lengths(points, edges), bent_lengths(points, jets.normals, edges)
    over = _over_creases(points, jets.normals, jets.forms, edges)
    return straight, np.where(over > straight, over, bent)


def _points_of_surface(vertices: Floats, topology: Topology) -> tuple[Floats, Jets]:
    """Return the surface points of vertices, and the patches round them.

    Vertices that decimation has put outside of a bend are put back. Noise makes every path longer, the more the closer
    the vertices are: where that brings the faces nearer to unfolding, all are put on their patches, and on patches
    fitted to those again. But not next to creases, which that would round off.
    vertices: (n, 3) mm. Returns points (n, 3) mm.
    """
    faces, edges = topology.faces, topology.edges
    rings = rings_of(vertices, faces, edges)
    noise = estimate_noise_sigma(vertices, rings)
    points, jets = vertices, fit_jets(vertices, rings, np.arange(len(vertices)), noise, noise)
    steepest, defect = _steepest_bend(jets, edges), _angle_defect(vertices, topology)
    smooth, bent = (_away_from_creases(vertices, jets, edges, turn) for turn in (steepest, np.pi))  # or however steeply
    inside = correct_decimation_bias(vertices, jets, edges, bent)
    again = _fitted_again(jets, inside, rings, bent, noise)
    if stood_outside(jets.offsets[bent], again.offsets[bent] - jets.offsets[bent]):
        defect_inside = _angle_defect(inside, topology)
        if defect_inside < ROUGHER * defect:
            points, jets, defect = inside, again, defect_inside
    on_patches = _on_patches(points, jets, smooth)
    if _angle_defect(on_patches, topology) >= defect:
        return points, jets
    smooth = _away_from_creases(on_patches, jets, edges, steepest)
    jets = _fitted_again(jets, on_patches, rings_of(on_patches, faces, edges), smooth, noise)
    return _on_patches(on_patches, jets, smooth), jets


def _on_patches(points: Floats, jets: Jets, chosen: Ints) -> Floats:
    """Points (n, 3) mm with the chosen (k,) moved onto their patches."""
    moved = points.copy()
    moved[chosen] += jets.normals[chosen] * jets.offsets[chosen, None]
    return moved


def _angle_defect(points: Floats, topology: Topology) -> float:
    """Return by how much, rad, angles round inner points (n, 3) of faces (m, 3) miss 2π.

    0 where the faces alone unfold into a plane.
    """
    angles = corner_angles(topology.faces, topology.sides, straight_lengths(points, topology.edges))
    missing = 2.0 * np.pi - np.bincount(topology.faces.ravel(), angles)
    return float(np.abs(missing[topology.inner]).sum())


def _fitted_again(jets: Jets, points: Floats, rings: Rings, chosen: Ints, noise: float) -> Jets:
    """The jets of all vertices, those of the chosen (k,) fitted to points (n, 3) mm."""
    fitted, again = Jets(*(of_all.copy() for of_all in jets)), fit_jets(points, rings, chosen, noise, noise)
    for of_all, of_chosen in zip(fitted, again, strict=True):
        of_all[chosen] = of_chosen[chosen]
    return fitted


def _steepest_bend(jets: Jets, edges: Ints) -> float:
    """Return the greatest rotation of normals along an edge of a bend, rad.

    A greater one is a crease. Patches pass by their vertices because of noise, and because no quadratic follows a steep
    bend: there neighbours lie on the same side of their patches. Where they do so no more often than by chance, noise
    is the greater part, and the rotations of bends, too, may be more than CREASE: up to SIGNIFICANT robust standard
    deviations of all of them, about 0.
    edges: (e, 2).
    """
    alike = jets.offsets[edges].prod(axis=1) > 0.0
    if alike.mean() > 0.5 + SIGNIFICANT * 0.5 / sqrt(len(edges)):
        return CREASE
    return max(CREASE, SIGNIFICANT * robust_sigma(_turns(jets.normals, edges)))


def _away_from_creases(points: Floats, jets: Jets, edges: Ints, steepest: float) -> Ints:
    """Return the vertices none of whose edges crosses a crease.

    Nor does an edge rotate the normal by more than the steepest bend, rad.
    points: (n, 3) mm.
    edges: (e, 2).
    """
    over = _over_creases(points, jets.normals, jets.forms, edges) > 0.0
    excluded = (jets.normals == 0.0).all(axis=1)  # nor is a vertex without a face
    excluded[edges[over | (_turns(jets.normals, edges) > steepest)]] = True
    return np.flatnonzero(~excluded)


def _turns(normals: Floats, edges: Ints) -> Floats:
    """Return the angles (e,) rad between the normals at the ends of edges.

    normals: (n, 3).
    edges: (e, 2).
    """
    cosines = (normals[edges[:, 0]] * normals[edges[:, 1]]).sum(axis=1)
    return np.asarray(np.arccos(np.clip(cosines, -1.0, 1.0)))


def estimate_noise_sigma(vertices: Floats, rings: Rings) -> float:
    """Estimate the noise of vertices off the surface, mm.

    The standard deviation, from patches that are not tied to their vertex.
    vertices: (n, 3).
    """
    size = max(float(axis.max() - axis.min()) for axis in vertices.T)
    used = np.flatnonzero(np.diff(rings.around.start))
    from_centre = ((vertices[used] - vertices[used].mean(axis=0)) ** 2).sum(axis=1)  # whatever their numbers are
    chosen = used[np.argsort(from_centre)[:: max(len(used) // PROBES, 1)]]
    noise = 0.0
    for _ in range(PASSES):
        offsets = np.sort(np.abs(fit_jets(vertices, rings, chosen, size, noise).offsets[chosen]))
        noise = MAD_TO_SIGMA * float(offsets[len(offsets) // 2]) / SHRUNK
    return max(noise, SINGLE_PRECISION * size)


@numba.njit(cache=True, error_model="numpy")
def bent_lengths(points: Floats, normals: Floats, edges: Ints) -> Floats:
    """Return distances (e,) mm on a surface that bends evenly.

    points, normals: (n, 3), unit normals.
    edges: (e, 2).
    """
    lengths, way = np.empty(len(edges)), np.empty(3)
    for k in range(len(edges)):
        a, b = edges[k, 0], edges[k, 1]
        chord = _set_way(points[a], points[b], way)
        lengths[k] = chord * _bent(_dot(normals[a], way), _dot(normals[b], way))
    return lengths


@numba.njit(cache=True, error_model="numpy")
def _over_creases(points: Floats, normals: Floats, forms: Floats, edges: Ints) -> Floats:
    """Return lengths (e,) mm over creases, 0 for edges that cross none.

    points: (n, 3) mm.
    normals, forms: (n, 3) and (n, 3, 3), of the patches round them.
    edges: (e, 2).
    """
    lengths, way, fold = np.zeros(len(edges)), np.empty(3), np.empty(3)
    for k in range(len(edges)):
        a, b = edges[k, 0], edges[k, 1]
        if _dot(normals[a], normals[b]) < LEVEL:
            chord = _set_way(points[a], points[b], way)
            lengths[k] = _over_crease(way, chord, normals[a], normals[b], forms[a], forms[b], fold)
    return lengths


@numba.njit(cache=True, error_model="numpy")
def _set_way(start: Floats, end: Floats, way: Floats) -> float:
    """Write the unit vector (3,) from one point to the other; how far it is."""
    for axis in range(3):
        way[axis] = end[axis] - start[axis]
    chord = max(sqrt(_dot(way, way)), SQUARE_TINY)
    for axis in range(3):
        way[axis] /= chord
    return chord


@numba.njit(cache=True, error_model="numpy")
def _bent(start: float, end: float) -> float:
    """Return length over chord of a cubic between two tangent planes.

    start, end: cosines of the chord with the normals of both.
    """
    rise, sink = -asin(min(max(start, -1.0), 1.0)), asin(min(max(end, -1.0), 1.0))
    return 1.0 + (2.0 * rise**2 + rise * sink + 2.0 * sink**2) / 30.0


@numba.njit(cache=True, error_model="numpy")
def _over_crease(
    way: Floats, chord: float, start: Floats, end: Floats, form: Floats, other: Floats, fold: Floats
) -> float:
    """Return the length over the crease between two patches, mm.

    Both are unfolded into one plane round the line in which they meet; 0 without a crease.
    way: (3,), direction to the other end.
    start, end: (3,), normals.
    fold: (3,), overwritten.
    """
    for p in range(3):
        m, n = (p + 1) % 3, (p + 2) % 3
        fold[p] = start[m] * end[n] - start[n] * end[m]
    sine = sqrt(_dot(fold, fold))
    if sine < CREASE:
        return 0.0
    turn = atan2(sine, _dot(start, end))
    fold /= sine
    along = chord * _dot(fold, way)
    # In the plane across the fold: the start at (0, 0), its tangent (1, 0), its normal (0, 1).
    x = chord * (_dot(way, end) - _dot(way, start) * cos(turn)) / sine
    y = chord * _dot(way, start)
    # Mirrored where the way goes to the left, so that the surface turns down and curvatures that go along are negative.
    side = 1.0 if _dot(way, end) >= _dot(way, start) else -1.0  # the same from either end, whatever the turn
    first, second = side * _curvature(form, start, fold), side * _curvature(other, end, fold)
    unexplained = turn - 0.5 * max(-first - second, 0.0) * sqrt(x * x + y * y)
    if unexplained < CREASE:
        return 0.0
    near, far = _meet(side * x, side * y, turn, first, second)
    return sqrt((near + far) ** 2 + along**2) if near > 0.0 and far > 0.0 else 0.0


@numba.njit(cache=True, error_model="numpy")
def _meet(x: float, y: float, turn: float, first: float, second: float) -> tuple[float, float]:
    """Return how far two curves run until they meet.

    One runs from (0, 0) along (1, 0), one from (x, y) back, turned down by `turn`. Negative where they do not meet
    between the ends. Paper rises to its spine the steeper the nearer it is; a patch that turns down to a crease has
    only taken in points from beyond.
    first, second: their curvatures upwards.
    """
    c, s = cos(turn), sin(turn)
    far = -y / s
    near = x - far * c
    if near <= 0.0 or far <= 0.0:
        return -1.0, -1.0
    first, second = max(first, 0.0), max(second, 0.0)
    for _ in range(ROUNDS):  # of Newton's method; one more changes no digit that counts
        # near·(1, 0) + first·near²/2·(0, 1) = (x, y) − far·(c, −s) + second·far²/2·(s, c)
        bend, back = first * near, second * far
        off_x = near - x + far * c - 0.5 * back * far * s
        off_y = 0.5 * bend * near - y - far * s - 0.5 * back * far * c
        by_far_x, by_far_y = c - back * s, -s - back * c
        determinant = by_far_y - bend * by_far_x
        if abs(determinant) < SQUARE_TINY:
            return -1.0, -1.0
        near -= (off_x * by_far_y - off_y * by_far_x) / determinant
        far -= (off_y - bend * off_x) / determinant
    return near * (1.0 + (first * near) ** 2 / 6.0), far * (1.0 + (second * far) ** 2 / 6.0)


@numba.njit(cache=True, error_model="numpy")
def _curvature(form: Floats, normal: Floats, fold: Floats) -> float:
    total = 0.0
    for p in range(3):
        m, n = (p + 1) % 3, (p + 2) % 3
        across = fold[m] * normal[n] - fold[n] * normal[m]
        for q in range(3):
            i, j = (q + 1) % 3, (q + 2) % 3
            total += across * form[p, q] * (fold[i] * normal[j] - fold[j] * normal[i])
    return total


@numba.njit(cache=True, error_model="numpy")
def _dot(a: Floats, b: Floats) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])
