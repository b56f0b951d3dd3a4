"""Light on places of a page: of the room, and of lamps, far or near, as far as the page itself lets it through.

What comes from a lamp goes with the cosine to it over the square of the distance, and only where the lamp is in sight;
what comes from the room is nearly the same on all slopes (Basri & Jacobs, "Lambertian reflectance and linear
subspaces", TPAMI 25(2), 2003, eq. 17: a constant and three terms linear in the normal hold most of it), less in
hollows.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np

from restore.bands import in_bands
from restore.scan import Floats, Ints, Mask
from restore.shading.horizon_map import HorizonMap, in_sight
from restore.shading.relief import Field

ROOM = 4  # terms: the room's light and its slopes along x, y, z


@dataclass(frozen=True, eq=False)
class Places:
    """Spots of the page: points (n, 3) mm and normals (n, 3) in the frame of the relief, openness (n,) 0 to 1, and
    nodes (n, 2) = (col, row) in the horizon map."""

    points: Field
    normals: Field
    openness: Field
    nodes: Field

    def __getitem__(self, chosen: Ints | slice) -> Places:
        return Places(self.points[chosen], self.normals[chosen], self.openness[chosen], self.nodes[chosen])


@dataclass(frozen=True, eq=False)
class Light:
    """The light found.

    lamps      (k, 3): azimuth and polar angle in the frame of the relief, seen from `middle` (3,) mm, and nearness,
               the inverse of the distance per mm, 0 for a lamp that is far away.
    strengths  (4 + k, 3): of the room, its slopes along x, y, z, and each lamp, per colour channel.
    """

    lamps: Floats
    strengths: Floats
    middle: Field
    horizon: HorizonMap

    def irradiance(self, places: Places) -> Field:
        """(n, 3) light on places of the page."""
        light, strengths = np.empty((len(places.points), 3), np.float32), self.strengths.astype(np.float32)

        def shine(band: slice) -> None:
            at = places[band]
            slopes = self.horizon.slopes
            _light(
                at.points, at.normals, at.openness, at.nodes, slopes, self.middle, self.lamps, strengths, light[band]
            )

        in_bands(shine, len(light))
        return light

    def terms(self, places: Places) -> Floats:
        """(n, 4 + k) the light of the room, its three slopes, and of each lamp, of strength 1 on places of the page."""
        return terms_of(room_terms(places), places, self.horizon, self.middle, self.lamps)

    def shadows(self, lamp: int, places: Places) -> Mask:
        """(n,) True where the page itself hides a lamp, or half of it, from its places."""
        shadows = np.empty(len(places.points), bool)

        def cast(band: slice) -> None:
            at = places[band]
            _shadows(at.points, at.nodes, self.horizon.slopes, self.middle, self.lamps[lamp], shadows[band])

        in_bands(cast, len(shadows))
        return shadows

    @property
    def of_one_colour(self) -> Light:
        """The same light, room and all lamps of the colour that falls on the page lying flat."""
        mean, level = self.strengths.mean(axis=1), self.level.astype(float)
        return replace(self, strengths=np.outer(mean, level / level.mean()))

    @property
    def level(self) -> Field:
        """(3,) the light on the page lying flat, in its middle, with nothing before it."""
        upright = np.array([1.0, 0.0, 0.0, 1.0, *np.cos(self.lamps[:, 1])])
        return np.asarray(upright @ self.strengths, dtype=np.float32)


def room_terms(places: Places) -> Floats:
    """(n, 4): the room's light and its three slopes."""
    upright = np.column_stack([np.ones(len(places.points)), places.normals])
    return np.asarray(places.openness[:, None] * upright, dtype=float)


def terms_of(room: Floats, places: Places, horizon: HorizonMap, middle: Field, lamps: Floats) -> Floats:
    """(n, 4 + k) the terms of the room (n, 4), and the light of lamps (k, 3) as `Light` has them, on places."""
    return np.asarray(_design_matrix(room, places.points, places.normals, places.nodes, horizon.slopes, middle, lamps))


@numba.njit(cache=True)
def _design_matrix(
    room: Floats, points: Field, normals: Field, nodes: Field, slopes: Field, middle: Field, lamps: Floats
) -> Floats:
    """(n, 4 + k) the room's terms (n, 4) and each lamp's light."""
    terms = np.empty((len(room), ROOM + len(lamps)))
    terms[:, :ROOM] = room
    for k in range(len(lamps)):
        terms[:, ROOM + k] = _lamp(points, normals, nodes, slopes, middle, lamps[k, 0], lamps[k, 1], lamps[k, 2])
    return terms


@numba.njit(cache=True)
def _lamp(
    points: Field, normals: Field, nodes: Field, slopes: Field, middle: Field, azimuth: float, polar: float, near: float
) -> Field:
    """(n,) light of one lamp: 1 on a place in the page's middle that faces it."""
    x = np.sin(polar) * np.cos(azimuth)
    y = np.sin(polar) * np.sin(azimuth)
    z = np.cos(polar)
    out = np.zeros(len(points), np.float32)
    for n in range(len(points)):
        u = x - near * (points[n, 0] - middle[0])
        v = y - near * (points[n, 1] - middle[1])
        w = z - near * (points[n, 2] - middle[2])
        cosine = u * normals[n, 0] + v * normals[n, 1] + w * normals[n, 2]
        if cosine > 0:
            square = u * u + v * v + w * w
            out[n] = cosine / (square * np.sqrt(square)) * in_sight(slopes, nodes[n, 0], nodes[n, 1], u, v, w)
    return out


@numba.njit(cache=True, nogil=True)
def _light(
    points: Field,
    normals: Field,
    openness: Field,
    nodes: Field,
    slopes: Field,
    middle: Field,
    lamps: Floats,
    strengths: Field,
    out: Field,
) -> None:
    """Write the light of the room and all lamps into out (n, 3)."""
    for n in range(len(points)):
        for c in range(3):
            slope = strengths[0, c]
            for k in range(3):
                slope += normals[n, k] * strengths[k + 1, c]
            out[n, c] = openness[n] * slope
    for k in range(len(lamps)):
        lamp = _lamp(points, normals, nodes, slopes, middle, lamps[k, 0], lamps[k, 1], lamps[k, 2])
        for n in range(len(points)):
            for c in range(3):
                out[n, c] += lamp[n] * strengths[k + ROOM, c]


@numba.njit(cache=True, nogil=True)
def _shadows(points: Field, nodes: Field, slopes: Field, middle: Field, lamp: Floats, out: Mask) -> None:
    """Write where less than half of a lamp is seen into out (n,)."""
    x, y, z = np.sin(lamp[1]) * np.cos(lamp[0]), np.sin(lamp[1]) * np.sin(lamp[0]), np.cos(lamp[1])
    for n in range(len(points)):
        u = x - lamp[2] * (points[n, 0] - middle[0])
        v = y - lamp[2] * (points[n, 1] - middle[1])
        w = z - lamp[2] * (points[n, 2] - middle[2])
        out[n] = in_sight(slopes, nodes[n, 0], nodes[n, 1], u, v, w) < 0.5
