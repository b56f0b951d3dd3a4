"""Light of the room and of lamps on places of a page, as far as the page lets it through.

The light of a lamp is proportional to the cosine to it over the square of the distance, and only where the lamp is in
sight; that of the room is nearly the same on all slopes (Basri & Jacobs, "Lambertian reflectance and linear subspaces",
TPAMI 25(2), 2003, eq. 17: a constant and three terms linear in the normal hold most of it), less in hollows. The page
reflects a fraction of both to itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numba
import numpy as np
from scipy.sparse import csr_matrix

from restore.runtime.threads import in_bands
from restore.scan import Floats, Mask
from restore.shading.horizon_map import in_sight
from restore.shading.relief import Field
from restore.shading.surroundings import Places, Surroundings

ROOM = 4  # terms: the room's light and its slopes along x, y, z


@dataclass(frozen=True, eq=False)
class Light:
    """The light found.

    lamps: (k, 3), azimuth and polar angle in the frame of the relief, seen from `middle` (3,) mm, and nearness, the
        inverse of the distance per mm, 0 for a lamp that is far away.
    reflectance: 0 to 1, fraction of the light that the page reflects.
    strengths: (4 + k, 3), of the room, its slopes along x, y, z, and each lamp, per colour channel.
    """

    lamps: Floats
    reflectance: float
    strengths: Floats
    middle: Field
    surroundings: Surroundings

    def irradiance(self, places: Places) -> Field:
        """Return the light (n, 3) on places of the page."""
        light, strengths = np.empty((len(places.points), 3), np.float32), self.strengths.astype(np.float32)
        patches = direct_terms(self.surroundings.patches, self.surroundings, self.middle, self.lamps) @ self.strengths
        reflected = self.surroundings.reflected((self.reflectance * patches).astype(np.float32))

        def shine(band: slice) -> None:
            at, slopes = places[band], self.surroundings.horizon.slopes
            _light(
                at.points,
                at.normals,
                at.openness,
                at.nodes,
                slopes,
                reflected,
                self.middle,
                self.lamps,
                strengths,
                light[band],
            )

        in_bands(shine, len(light))
        return light

    def terms(self, places: Places) -> Floats:
        """Return terms (n, 4 + k) of unit light of the room, its three slopes, and each lamp."""
        return Terms(places, self.surroundings, self.middle).of(self.lamps, self.reflectance)

    def shadows(self, lamp: int, places: Places) -> Mask:
        """Return the places (n,) from which the page hides a lamp, or half of it."""
        shadows = np.empty(len(places.points), bool)

        def cast(band: slice) -> None:
            at, slopes = places[band], self.surroundings.horizon.slopes
            _shadows(at.points, at.nodes, slopes, self.middle, self.lamps[lamp], shadows[band])

        in_bands(cast, len(shadows))
        return shadows

    @property
    def of_one_colour(self) -> Light:
        """The same light, room and all lamps of the colour that falls on the page lying flat."""
        mean, level = self.strengths.mean(axis=1), self.level.astype(float)
        return replace(self, strengths=np.outer(mean, level / level.mean()))

    @property
    def level(self) -> Field:
        """Return the light (3,) on the flat page, in its centre, with nothing before it."""
        upright = np.array([1.0, 0.0, 0.0, 1.0, *np.cos(self.lamps[:, 1])])
        return np.asarray(upright @ self.strengths, dtype=np.float32)


@dataclass(frozen=True, eq=False)
class Terms:
    """Light on places from lamps that are yet to be found.

    The lamps are seen from `middle` (3,) mm.
    """

    places: Places
    surroundings: Surroundings
    middle: Field

    def of(self, lamps: Floats, reflectance: float) -> Floats:
        """Return the terms (n, 4 + k) of light of strength 1, with reflections.

        Of the room, its three slopes, and each lamp (k, 3); a page of some reflectance adds to them.
        """
        from_patches = direct_terms(self.surroundings.patches, self.surroundings, self.middle, lamps)
        return direct_terms(self.places, self.surroundings, self.middle, lamps) + reflectance * (
            self._fractions @ from_patches
        )

    @cached_property
    def _fractions(self) -> csr_matrix:
        return self.surroundings.fractions_at(self.places)


def direct_terms(places: Places, surroundings: Surroundings, middle: Field, lamps: Floats) -> Floats:
    """Return terms (n, 4 + k) of direct light: room, three slopes, lamps (k, 3) of `Light`."""
    return np.asarray(
        _design_matrix(
            places.points, places.normals, places.openness, places.nodes, surroundings.horizon.slopes, middle, lamps
        )
    )


@numba.njit(cache=True)
def _design_matrix(
    points: Field, normals: Field, openness: Field, nodes: Field, slopes: Field, middle: Field, lamps: Floats
) -> Floats:
    """Return the room's light, its three slopes, and each lamp's light, (n, 4 + k)."""
    terms = np.empty((len(points), ROOM + len(lamps)))
    for n in range(len(points)):
        terms[n, 0] = openness[n]
        for i in range(3):
            terms[n, 1 + i] = openness[n] * normals[n, i]
    for k in range(len(lamps)):
        terms[:, ROOM + k] = _lamp(points, normals, nodes, slopes, middle, lamps[k, 0], lamps[k, 1], lamps[k, 2])
    return terms


@numba.njit(cache=True)
def _lamp(
    points: Field, normals: Field, nodes: Field, slopes: Field, middle: Field, azimuth: float, polar: float, near: float
) -> Field:
    """Return the light (n,) of one lamp, 1 on a place in the page's centre that faces it."""
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
    reflected: Field,
    middle: Field,
    lamps: Floats,
    strengths: Field,
    out: Field,
) -> None:
    """Write the light of room and lamps, and that reflected, into out.

    reflected: (rows, cols, 3), to nodes.
    out: (n, 3).
    """
    rows, cols, _ = reflected.shape
    for n in range(len(points)):
        col, row = min(max(nodes[n, 0], 0.0), cols - 1.001), min(max(nodes[n, 1], 0.0), rows - 1.001)
        j, i = int(col), int(row)
        u, v = np.float32(col - j), np.float32(row - i)
        for c in range(3):
            slope = strengths[0, c]
            for k in range(3):
                slope += normals[n, k] * strengths[k + 1, c]
            above = reflected[i, j, c] + u * (reflected[i, j + 1, c] - reflected[i, j, c])
            below = reflected[i + 1, j, c] + u * (reflected[i + 1, j + 1, c] - reflected[i + 1, j, c])
            out[n, c] = openness[n] * slope + above + v * (below - above)
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
