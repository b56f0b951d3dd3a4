"""The crease of an open book: the straight line along which its surface turns most."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from restore.numerics.limits import TINY
from restore.photogrammetry.surfaces.surface import Surface, grid_places
from restore.scan import Floats, Ints

LATTICE_MM = 2.0  # of the places at which a surface's bending is summed up: a quarter of a knot
STRIP_MM = 2 * LATTICE_MM  # along a line: a line of any direction has places in each strip
REFINEMENTS = 3
DIRECTIONS = np.radians(np.arange(180.0))


@dataclass(frozen=True, eq=False)
class Crease:
    """A line on the flat page.

    across: (2,), its unit normal.
    offset: mm, of the line along it.
    """

    across: Floats
    offset: float

    @property
    def turn(self) -> Floats:
        """The rotation (2, 2) of places that makes the line upright."""
        return np.array([self.across, [-self.across[1], self.across[0]]])

    def sides(self, places: Floats, clear: float) -> Ints:
        """Return the side (n,) of the line, 0 or 1, on which places (n, 2) mm lie.

        clear: mm from the line, within which they are on none: −1.
        """
        beyond = self.beyond(places)
        return np.where(np.abs(beyond) < clear, -1, beyond > 0)

    def beyond(self, places: Floats) -> Floats:
        """Return how far places (n, 2) mm lie beyond the line, (n,) mm."""
        return np.asarray(places @ self.across - self.offset)


def find_crease(places: Floats, smooth: Surface, least: float) -> Crease:
    """Return the line along which a surface turns most, all of it to one side.

    A smooth surface rounds a crease to a ridge of bending as wide as its knots. Bending across the lines of a direction
    is summed up in strips along them: zigzags and bends across other lines cancel out.
    places: (n, 2) mm, of its points.
    least: fraction of them on either side of the line.
    """
    lattice = grid_places(places.min(axis=0), places.max(axis=0), LATTICE_MM)
    uu, uv, vv = _bending(smooth, lattice)
    most, found = -1.0, Crease(np.array([1.0, 0.0]), float(np.median(places[:, 0])))
    for across in np.stack([np.cos(DIRECTIONS), np.sin(DIRECTIONS)], axis=1):
        x, y = across
        bending = x * x * uu + 2 * x * y * uv + y * y * vv
        along = lattice @ across
        low, high = np.quantile(places @ across, [least, 1 - least])
        strips = np.floor((along - low) / STRIP_MM).astype(int)
        inner = (strips >= 0) & (along < high)
        turn = np.abs(np.bincount(strips[inner], bending[inner]))
        best = int(turn.argmax())
        if turn[best] > most:
            most, found = turn[best], Crease(across, low + (best + 0.5) * STRIP_MM)
    for _ in range(REFINEMENTS):
        found = _through_ridge(found, lattice, uu, uv, vv, smooth.step)
    return found


def _through_ridge(crease: Crease, lattice: Floats, uu: Floats, uv: Floats, vv: Floats, reach: float) -> Crease:
    """Return the line through the ridge of bending next to a line, by weighted least squares.

    lattice: (n, 2) mm. uu, uv, vv: (n,) 1/mm, the bending there. reach: mm.
    """
    near = np.abs(crease.beyond(lattice)) < reach
    x, y = crease.across
    weights = np.abs(x * x * uu + 2 * x * y * uv + y * y * vv)[near] + TINY
    off, along = (lattice[near] @ crease.turn.T - [crease.offset, 0.0]).T
    slope, shift = np.polyfit(along, off, 1, w=np.sqrt(weights))
    across = crease.across - slope * crease.turn[1]
    across /= np.linalg.norm(across)
    return Crease(across, float((crease.offset + shift) * (crease.across @ across)))


def _bending(smooth: Surface, places: Floats) -> Floats:
    """Return the bending (3, n) 1/mm of a surface at places (n, 2) mm, by uu, uv and vv."""
    by = smooth.derivatives(places)
    normals = np.cross(by[:, 1], by[:, 2])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return np.einsum("nki,ni->kn", by[:, 3:], normals)
