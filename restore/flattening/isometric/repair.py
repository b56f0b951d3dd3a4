"""Repairs the faces that a least-strain page has inverted.

Lengths alone cannot distinguish a corner of the border from its mirror image. Inside the page a face inverts where
lengths contradict each other, mostly over a crease that no vertex samples. A face that is folded over in space is
inverted on the page too, and rightly so: its sign is negative, and it is left alone.
"""

from __future__ import annotations

import numba
import numpy as np

from restore.flattening.isometric.gauss_newton import MAX_ITERATIONS, minimise_strain, strained_less
from restore.flattening.solution import Solution
from restore.mesh.measures import signed_areas
from restore.mesh.network import Network
from restore.numerics.limits import TINY
from restore.scan import Floats, Ints

OPEN = 0.02  # of its area on the surface is a face opened to, or rounding could turn it over
CONTRADICTED = 0.5  # of its area on the surface: a face that lengths invert by that much is folded, whatever its normal


def opened(found: Solution, network: Network, signs: Floats) -> Solution:
    """Return the page with its inverted faces opened, if that is better.

    Fewer must be inverted, and the page not strained more. Corners of the border invert, whose mirror images have the
    same lengths, and vertices that a start has put on the wrong side.
    signs: (m,), as for `repaired`.
    """
    inverted = inverted_count(found.flat, network.faces, signs)
    if not inverted:
        return found
    again = minimise_strain(uninverted(found.flat, network, signs), network)
    fewer = inverted_count(again.flat, network.faces, signs) < inverted
    return again if fewer and not strained_less(found.flat, again.flat, network) else found


def repaired(flat: Floats, network: Network, signs: Floats) -> Floats:
    """Return a page without the inverted faces that the lengths leave open.

    flat: (n, 2) mm, a page of least strain.
    signs: (m,), −1 for the faces that are folded in space.
    Returns (n, 2) mm, near the given page.
    """
    if not inverted_count(flat, network.faces, signs):
        return flat
    areas = signed_areas(flat, network.faces) * signs
    contradicted = areas < -CONTRADICTED * network.areas
    return uninverted(flat, network, np.where(contradicted, -signs, signs))


def inverted_count(flat: Floats, faces: Ints, signs: Floats) -> int:
    """Count the faces whose orientation on the page is against their sign.

    flat: (n, 2).
    faces: (m, 3), with signs (m,). A face without area has no orientation.
    """
    return int((signed_areas(flat, faces) * signs < 0.0).sum())


def uninverted(flat: Floats, network: Network, signs: Floats) -> Floats:
    """Return a page with fewer inverted faces, where possible.

    Only the corners of such faces are moved. Returns (n, 2) mm.
    """
    turned, least = flat.copy(), OPEN * network.areas
    open_inverted(turned, network.faces, signs, least)
    fewer = inverted_count(turned, network.faces, signs) < inverted_count(flat, network.faces, signs)
    return turned if fewer else flat


def open_inverted(flat: Floats, faces: Ints, signs: Floats, least: Floats) -> None:
    """Open inverted faces by moving their corners, in place.

    A face is opened along the gradient of its area: the least displacement that does it. In a sweep the most inverted
    come first, whatever numbers they have.
    flat: (n, 2) mm.
    least: (m,) mm², the area that each is opened to.
    """
    for _ in range(MAX_ITERATIONS):  # as opening one may close its neighbours
        areas = signed_areas(flat, faces) * signs
        below = np.flatnonzero(areas < least)
        if _open(flat, faces, signs, least, below[np.argsort(areas[below], kind="stable")]) == 0:
            break


@numba.njit(cache=True)
def _open(flat: Floats, faces: Ints, signs: Floats, least: Floats, order: Ints) -> int:
    """One sweep over faces (m, 3) in an order (k,): how many of them were inverted."""
    inverted = 0
    for f in order:
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ux, uy = flat[b, 0] - flat[a, 0], flat[b, 1] - flat[a, 1]
        vx, vy = flat[c, 0] - flat[a, 0], flat[c, 1] - flat[a, 1]
        area = signs[f] * (0.5 * (ux * vy - uy * vx))  # those before may have changed it
        if area >= 0.0:
            continue
        inverted += 1
        ax, ay = 0.5 * (flat[b, 1] - flat[c, 1]), 0.5 * (flat[c, 0] - flat[b, 0])
        bx, by = 0.5 * (flat[c, 1] - flat[a, 1]), 0.5 * (flat[a, 0] - flat[c, 0])
        cx, cy = 0.5 * (flat[a, 1] - flat[b, 1]), 0.5 * (flat[b, 0] - flat[a, 0])
        squares = ax * ax + ay * ay + bx * bx + by * by + cx * cx + cy * cy
        step = signs[f] * (least[f] - area) / (squares + TINY)
        flat[a, 0] += step * ax
        flat[a, 1] += step * ay
        flat[b, 0] += step * bx
        flat[b, 1] += step * by
        flat[c, 0] += step * cx
        flat[c, 1] += step * cy
    return inverted
