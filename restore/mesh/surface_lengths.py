"""How far the vertices of a mesh are apart along the surface that it samples.

The straight edge is too short over a bend, far too short over a crease between its ends, and too long between vertices
that noise has moved. The patches round both ends tell the length of the way between them.
"""

from __future__ import annotations

from math import asin, atan2, cos, radians, sin, sqrt

import numba
import numpy as np

from restore.mesh.jets import SIGMAS, Rings, fit_jets, rings_of
from restore.mesh.measures import straight_lengths
from restore.numerics import SQUARE_TINY
from restore.robust import MAD_TO_SIGMA
from restore.scan import Floats, Ints

SURE = SIGMAS * SIGMAS  # turns of less are noise
PROBES = 100  # vertices that tell the noise
SHRUNK = 0.87  # of the noise is left when a patch passes between a vertex and its neighbours
LEAST_NOISE = 1e-7  # of the page's size: no file holds more digits
GRAINY = 0.013  # noise in mean edges: more of it lengthens edges by more than creases do
MANY = 2500  # vertices: of fewer a patch is a tenth of the page, and bends within it look like noise
SMOOTHINGS = 2  # of grainy vertices: a third to two thirds of what noise adds is gone
SHARP = cos(radians(10.0))  # cosine of a turn between neighbours that may be a crease
CREASE = 0.1  # radians, 6°: a turn that the curvature of both patches does not explain is a crease
LEVEL = cos(CREASE)
STEEPEST = 0.9  # slope of a patch against its tangent plane at the crease: beyond, its curvature is a guess
BENDINGS = 3  # of the tangents towards the crease, by Newton's method; a fourth changes no digit that counts


def surface_lengths(vertices: Floats, faces: Ints, edges: Ints) -> Floats:
    """(e,) mm between the ends of edges (e, 2), along the surface through vertices (n, 3) mm of faces (m, 3).

    Noise makes every way longer, the more the closer the vertices lie. Where they are grainy they are put on their
    patches, and patches fitted to those again, but beside creases, which that would round off.
    """
    rings = rings_of(vertices, faces, edges)
    noise = estimate_noise_sigma(vertices, rings)
    jets = fit_jets(vertices, rings, np.arange(len(vertices)), noise, noise)
    points = vertices + jets.normals * jets.offsets[:, None]
    grainy = len(vertices) > MANY and noise > GRAINY * float(straight_lengths(vertices, edges).mean())
    for _ in range(SMOOTHINGS if grainy else 0):
        smooth = _beside_no_crease(jets.normals, edges)
        again = fit_jets(points, rings_of(points, faces, edges), smooth, noise, noise)
        jets.normals[smooth], jets.forms[smooth] = again.normals[smooth], again.forms[smooth]
        points += again.normals * again.offsets[:, None]
    return _all_lengths(points, jets.normals, jets.forms, jets.variances, edges)


def _beside_no_crease(normals: Floats, edges: Ints) -> Ints:
    """The vertices with normals (n, 3) that turn by less than a crease along all of their edges (e, 2)."""
    turned = (normals[edges[:, 0]] * normals[edges[:, 1]]).sum(axis=1) < SHARP
    beside = np.zeros(len(normals), bool)
    beside[edges[turned]] = True
    return np.flatnonzero(~beside)


def estimate_noise_sigma(vertices: Floats, rings: Rings) -> float:
    """Standard deviation of the vertices (n, 3) off the surface, mm, from patches that are not tied to their vertex."""
    size = max(float(axis.max() - axis.min()) for axis in vertices.T)
    from_centre = ((vertices - vertices.mean(axis=0)) ** 2).sum(axis=1)  # whatever numbers the vertices have
    chosen = np.argsort(from_centre)[:: max(len(vertices) // PROBES, 1)]
    offsets = np.sort(np.abs(fit_jets(vertices, rings, chosen, size).offsets[chosen]))
    return max(MAD_TO_SIGMA * float(offsets[len(offsets) // 2]) / SHRUNK, LEAST_NOISE * size)


@numba.njit(cache=True, error_model="numpy")
def bent_lengths(points: Floats, normals: Floats, edges: Ints) -> Floats:
    """(e,) mm between points (n, 3) on a surface that bends evenly from one to the other; unit normals (n, 3) there."""
    lengths, way = np.empty(len(edges)), np.empty(3)
    for k in range(len(edges)):
        a, b = edges[k, 0], edges[k, 1]
        chord = _set_way(points[a], points[b], way)
        lengths[k] = chord * _bent(_dot(normals[a], way), _dot(normals[b], way))
    return lengths


@numba.njit(cache=True, error_model="numpy")
def _all_lengths(points: Floats, normals: Floats, forms: Floats, variances: Floats, edges: Ints) -> Floats:
    """(e,) mm along the surface. points, normals (n, 3), forms (n, 3, 3): the patches round every vertex."""
    lengths, way, fold = np.empty(len(edges)), np.empty(3), np.empty(3)
    for k in range(len(edges)):
        a, b = edges[k, 0], edges[k, 1]
        chord, broken = _set_way(points[a], points[b], way), 0.0
        if _dot(normals[a], normals[b]) < LEVEL:
            broken = _over_crease(way, chord, normals[a], normals[b], forms[a], forms[b], fold)
        slopes = variances[a, 0] + variances[b, 0]
        if broken > chord:
            height = variances[a, 1] + variances[b, 1] + chord**2 * slopes
            height += 0.25 * chord**4 * (variances[a, 2] + variances[b, 2])
            cosine = min(_dot(normals[a], normals[b]), 1.0)
            lengths[k] = chord + _share_kept(broken - chord, cosine, slopes, height) * (broken - chord)
        else:
            bent = chord * (_bent(_dot(normals[a], way), _dot(normals[b], way)) - 1.0)
            lengths[k] = chord + max(bent - chord * 2.0 * slopes / 30.0, 0.0)  # what noise adds to the cubic
    return lengths


@numba.njit(cache=True, error_model="numpy")
def _share_kept(gain: float, cosine: float, slopes: float, height: float) -> float:
    """How much of what a path over a crease is longer than the chord is kept (positive-part James & Stein).

    cosine is that of the turn; slopes and height are the variances of the normals and, in mm², of one patch's height
    above the other: the gain goes with the height over the sine of the turn.
    """
    turned, sine = 2.0 - 2.0 * cosine, max(1.0 - cosine**2, CREASE**2)
    by_turn = max(0.0, 1.0 - SURE * slopes / turned)
    return by_turn * max(0.0, 1.0 - height / sine * (1.0 - cosine) ** 2 / gain**2)


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
    """Length over straight distance of the cubic that leaves and arrives along two tangent planes.

    start and end are the cosines of the way with the normals of both.
    """
    rise, sink = -asin(min(max(start, -1.0), 1.0)), asin(min(max(end, -1.0), 1.0))
    return 1.0 + (2.0 * rise**2 + rise * sink + 2.0 * sink**2) / 30.0


@numba.njit(cache=True, error_model="numpy")
def _over_crease(
    way: Floats, chord: float, start: Floats, end: Floats, form: Floats, other: Floats, fold: Floats
) -> float:
    """mm from one patch to the other, both laid into one plane round the line in which they meet; 0 without a crease.

    way (3,) is the direction to the other end; start, end (3,) are the normals; fold (3,) is written over.
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
    """How far two curves run till they meet: one from (0, 0) along (1, 0), one from (x, y) back, turned down by `turn`.

    first and second are their curvatures upwards. Negative where they do not meet between the ends. Paper rises to its
    spine the steeper the nearer it is; a patch that turns down to a crease has only taken in points from beyond.
    """
    c, s = cos(turn), sin(turn)
    far = -y / s
    near = x - far * c
    if near <= 0.0 or far <= 0.0:
        return -1.0, -1.0
    first, second = _tamed(first, near), _tamed(second, far)
    for _ in range(BENDINGS):
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
def _tamed(curvature: float, distance: float) -> float:
    """A curvature upwards that turns a patch by no more than STEEPEST on its way."""
    return min(max(curvature, 0.0), STEEPEST / distance)


@numba.njit(cache=True, error_model="numpy")
def _curvature(form: Floats, normal: Floats, fold: Floats) -> float:
    """Normal curvature of a patch across a fold."""
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
