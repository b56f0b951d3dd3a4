"""Turn back the faces that a least-strain page has inverted.

Lengths alone cannot tell a corner of the border from its mirror image. Inside the page a face inverts where lengths
contradict each other, mostly over a crease that no vertex samples. A face that is folded over in space is inverted on
the page too, and rightly so: its sign is negative, and it is left alone.
"""

from __future__ import annotations

import numba
import numpy as np

from restore.flattening.gauss_newton import (
    HALVINGS,
    ROUGHLY,
    least_absolute_strain,
    minimise_strain,
    rest_areas,
)
from restore.flattening.solution import Solution
from restore.mesh.adjacency import Adjacency, adjacency, faces_around
from restore.mesh.measures import signed_areas
from restore.mesh.network import Network
from restore.numerics import SMALL, TINY
from restore.scan import Floats, Ints, Mask

OPEN = 0.02  # of its area on the surface is a face opened to, or rounding could turn it over
CONTRADICTED = 0.5  # of its area on the surface: a face that lengths invert by so much is folded, whatever its normal
SWEEPS = 50  # over inverted faces, as opening one may close its neighbours, and over the few vertices round them


def least_strain_page(flat: Floats, network: Network, signs: Floats | None = None) -> Solution:
    """The flat positions (n, 2) mm of least strain near a start, without inverted faces where that can be had.

    signs (m,) are −1 for the faces that are folded in space; all are 1 when None.
    """
    signs = np.ones(len(network.faces)) if signs is None else signs
    found = minimise_strain(flat, network)
    if inverted := inverted_count(found.flat, network.faces, signs):  # corners of the border, perhaps
        opened = found.flat.copy()
        open_inverted(opened, network.faces, signs, _least_areas(network))
        again = minimise_strain(opened, network)
        found = again if inverted_count(again.flat, network.faces, signs) < inverted else found
    return found._replace(flat=repaired(found.flat, network, signs))


def least_absolute_page(flat: Floats, network: Network, signs: Floats | None = None) -> Solution:
    """The flat positions (n, 2) mm of least absolute strain near a start: a few wrong lengths hardly move them.

    signs (m,) as for `least_strain_page`.
    """
    signs = np.ones(len(network.faces)) if signs is None else signs
    found = least_absolute_strain(minimise_strain(flat, network, least_decrease=ROUGHLY), network)
    return found._replace(flat=repaired(found.flat, network, signs))


def repaired(flat: Floats, network: Network, signs: Floats) -> Floats:
    """Flat positions (n, 2) mm near a page of least strain without the inverted faces that the lengths leave open.

    signs (m,) are −1 for the faces that are folded in space.
    """
    if not inverted_count(flat, network.faces, signs):
        return flat
    return uninverted(flat, network, _signs_on_page(flat, network, signs))


def _signs_on_page(flat: Floats, network: Network, signs: Floats) -> Floats:
    """The signs (m,), turned where the lengths contradict them."""
    areas = signed_areas(flat, network.faces) * signs
    wrong = areas < -CONTRADICTED * rest_areas(network.faces, network.sides, network.lengths)
    return np.where(wrong, -signs, signs)


@numba.njit(cache=True)
def inverted_count(flat: Floats, faces: Ints, signs: Floats) -> int:
    """How many faces (m, 3) of flat (n, 2) lie against their sign (m,); a face without area has none."""
    return int((signed_areas(flat, faces) * signs < 0.0).sum())


def uninverted(flat: Floats, network: Network, signs: Floats) -> Floats:
    """Flat positions (n, 2) mm with fewer inverted faces, if that can be; only vertices near them are moved.

    Inverted faces are opened by the least displacement of their corners, one after the other, until none is left. Then
    each vertex near them goes to where its edges are strained least without inverting a face again.
    """
    faces, edges, before, flat = network.faces, network.edges, flat, flat.copy()
    least = _least_areas(network)
    near = open_inverted(flat, faces, signs, least)
    near[edges[near[edges].any(axis=1)]] = True
    edges_at = adjacency(edges.ravel(), np.repeat(np.arange(len(edges)), 2), len(flat))
    around = faces_around(faces, len(flat))
    moving = np.flatnonzero(near)
    moving = moving[np.argsort(((flat[moving] - flat.mean(axis=0)) ** 2).sum(axis=1))]  # whatever numbers they have
    relax_uninverted(flat, faces, signs, edges, network.lengths, edges_at, around, moving, least)
    return flat if inverted_count(flat, faces, signs) < inverted_count(before, faces, signs) else before


def _least_areas(network: Network) -> Floats:
    """(m,) mm² that the faces of a network are opened to."""
    return np.asarray(OPEN * rest_areas(network.faces, network.sides, network.lengths))


@numba.njit(cache=True)
def open_inverted(flat: Floats, faces: Ints, signs: Floats, least: Floats) -> Mask:
    """Move the corners of inverted faces, in place, until no area is below its least (m,); the vertices (n,) moved.

    flat (n, 2) mm. A face is opened along the gradient of its area: the least displacement that does it. In a sweep
    the most inverted come first, whatever numbers they have.
    """
    moved, way = np.zeros(len(flat), np.bool_), np.empty((3, 2))
    for _ in range(SWEEPS):
        areas = signed_areas(flat, faces) * signs
        below, inverted = np.flatnonzero(areas < least), 0
        for f in below[np.argsort(areas[below])]:
            area = _signed_area(f, flat, faces, signs)
            if area >= 0.0:
                continue
            inverted += 1
            squares = TINY
            for k in range(3):
                p, q = faces[f, (k + 1) % 3], faces[f, (k + 2) % 3]
                way[k, 0], way[k, 1] = 0.5 * (flat[p, 1] - flat[q, 1]), 0.5 * (flat[q, 0] - flat[p, 0])
                squares += way[k, 0] ** 2 + way[k, 1] ** 2
            step = signs[f] * (least[f] - area) / squares
            for k in range(3):
                i = faces[f, k]
                moved[i] = True
                flat[i, 0] += step * way[k, 0]
                flat[i, 1] += step * way[k, 1]
        if inverted == 0:
            break
    return moved


@numba.njit(cache=True)
def relax_uninverted(
    flat: Floats,
    faces: Ints,
    signs: Floats,
    edges: Ints,
    lengths: Floats,
    edges_at: Adjacency,
    around: Adjacency,
    moving: Ints,
    least: Floats,
) -> None:
    """Relax the edges at the moving vertices (k,), flat (n, 2) in place, while no face gets below its least (m,)."""
    for _ in range(SWEEPS):
        for i in moving:
            x, y, count = 0.0, 0.0, max(edges_at.start[i + 1] - edges_at.start[i], 1)
            for q in range(edges_at.start[i], edges_at.start[i + 1]):
                k = edges_at.items[q]
                other = edges[k, 0] + edges[k, 1] - i
                off_x, off_y = flat[other, 0] - flat[i, 0], flat[other, 1] - flat[i, 1]
                share = 1.0 - lengths[k] / (np.sqrt(off_x * off_x + off_y * off_y) + SMALL)
                x += share * off_x / count
                y += share * off_y / count
            was_x, was_y = flat[i, 0], flat[i, 1]
            before = _room(i, flat, faces, signs, around, least)
            step = 1.0
            for _ in range(HALVINGS):
                flat[i, 0], flat[i, 1] = was_x + step * x, was_y + step * y
                if _room(i, flat, faces, signs, around, least) >= min(0.0, before):
                    break
                step *= 0.5
            else:
                flat[i, 0], flat[i, 1] = was_x, was_y


@numba.njit(cache=True)
def _room(i: int, flat: Floats, faces: Ints, signs: Floats, around: Adjacency, least: Floats) -> float:
    """By how much, mm², the faces at vertex i are larger than their least at least; negative where one is not."""
    room = np.inf
    for q in range(around.start[i], around.start[i + 1]):
        f = around.items[q]
        room = min(room, _signed_area(f, flat, faces, signs) - least[f])
    return room


@numba.njit(cache=True)
def _signed_area(f: int, flat: Floats, faces: Ints, signs: Floats) -> float:
    """The area of face f, mm², negative where it lies against its sign."""
    a, b, c = faces[f]
    ux, uy = flat[b, 0] - flat[a, 0], flat[b, 1] - flat[a, 1]
    vx, vy = flat[c, 0] - flat[a, 0], flat[c, 1] - flat[a, 1]
    return float(0.5 * signs[f] * (ux * vy - uy * vx))
