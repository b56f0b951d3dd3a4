"""A crumpled sheet, made by mirroring.

Where a sheet crosses a plane, the part beyond it may be mirrored at the plane: the sheet stays whole and no length on
it changes. Planes that lie nearly level turn crests into hollows and leave a net of creases like that of a crumpled
page, with an exact flat truth: its strain is zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from drivers.simulated.scene.sheets.facets import areas_of, level, mesh_of_polygons, split
from drivers.simulated.scene.sheets.sheet import PageSize, corners, parameters
from restore.scan import Floats, Ints

NARROW_MM = 5.0  # paper of 0.1 mm does not hold pleats much narrower than this when crumpled by hand …
MAX_NARROW_FRACTION = 0.1  # … but corners where creases meet are narrow: they may cover this fraction of the page
TRIALS = 500  # planes tried for one crease; where none fits, the sheet is as crumpled as its steepest slope allows


@dataclass(frozen=True, eq=False)
class Facet:
    """Flat piece: outline (k, 2) mm on the page, rotation (3, 2) and shift (3,) mm."""

    outline: Floats
    rotation: Floats
    shift: Floats

    @property
    def normal(self) -> Floats:
        """Return the unit normal (3,) towards the reader."""
        return np.cross(self.rotation[:, 0], self.rotation[:, 1])

    @property
    def place(self) -> Floats:
        """Return the corners (k, 3) mm of the outline in space."""
        return np.asarray(self.outline @ self.rotation.T + self.shift)

    def mirrored(self, plane: Floats) -> Facet:
        """The facet mirrored at a plane (4,): its unit normal and its offset along it."""
        normal = plane[:3]
        mirror = np.eye(3) - 2 * np.outer(normal, normal)
        return Facet(self.outline, mirror @ self.rotation, mirror @ self.shift + 2 * plane[3] * normal)


@parameters
class Crumpled:
    """A sheet crumpled and laid down again.

    planes     how often it was mirrored, unless no plane fits; each adds a crease across the page or round a dent.
    tilt_deg   most that a plane may lean from level; more makes sharper creases.
    steep_deg  steepest slope that a facet may reach before the sheet is levelled.
    seed       which crumple it is.
    """

    name: ClassVar[str] = "crumpled"
    planes: Annotated[int, Field(ge=1, le=60)] = 14
    tilt_deg: Annotated[float, Field(ge=1, le=30)] = 11.0
    steep_deg: Annotated[float, Field(ge=5, le=75)] = 45.0
    seed: Annotated[int, Field(ge=0)] = 0

    def warp(self, paper: Floats, page_mm: PageSize) -> Floats:
        """Map points of the flat page to space, (…, 3) mm.

        They are mirrored at one plane after the other, then levelled.
        """
        planes, _, upright = crumple(self, page_mm)
        space = np.concatenate([paper, np.zeros((*paper.shape[:-1], 1))], axis=-1)
        for plane in planes:
            beyond = np.maximum(space @ plane[:3] - plane[3], 0)
            space = space - 2 * beyond[..., None] * plane[:3]
        return space @ upright.T

    def mesh(self, page_mm: PageSize) -> tuple[Floats, Ints]:
        """The facets between creases: points (n, 2) mm of the flat page and triangles (m, 3)."""
        return mesh_of_polygons([facet.outline for facet in crumple(self, page_mm)[1]])


@cache
def crumple(sheet: Crumpled, page_mm: PageSize) -> tuple[tuple[Floats, ...], tuple[Facet, ...], Floats]:
    """Crumple a sheet.

    Returns the planes (n, d) whose side n·x > d is mirrored, the resulting facets, and the levelling rotation.
    """
    rng = np.random.default_rng(sheet.seed)
    facets: tuple[Facet, ...] = (Facet(corners(page_mm), np.eye(3)[:, :2], np.zeros(3)),)
    planes: list[Floats] = []
    while len(planes) < sheet.planes:
        found = _crease(rng, facets, sheet)
        if found is None:
            break
        facets, planes = found[1], [*planes, found[0]]
    normals, areas = np.array([f.normal for f in facets]), areas_of([f.outline for f in facets])
    return tuple(planes), facets, level(normals, areas)


def _crease(
    rng: np.random.Generator, facets: tuple[Facet, ...], sheet: Crumpled
) -> tuple[Floats, tuple[Facet, ...]] | None:
    """Return a random plane, and the facets mirrored at it, or None.

    It leaves no facet too steep and few too narrow.
    """
    places, normals = [f.place for f in facets], np.array([f.normal for f in facets])
    areas = areas_of([f.outline for f in facets])
    starts, space = np.cumsum([0, *map(len, places[:-1])]), np.concatenate(places)
    for _ in range(TRIALS):
        through = places[rng.choice(len(facets), p=areas / areas.sum())]
        plane = _random_plane(rng, rng.dirichlet(np.ones(len(through))) @ through, np.radians(sheet.tilt_deg))
        reached = np.maximum.reduceat(space @ plane[:3] - plane[3], starts) > 0
        up = 2 * (normals[reached] @ plane[:3]) * plane[2] - normals[reached, 2]  # a mirror turns the normal round
        if (
            up.min() > np.cos(np.radians(sheet.steep_deg))
            and _narrow(trial := _mirror(facets, plane)) < MAX_NARROW_FRACTION
        ):
            return plane, trial
    return None


def _narrow(facets: tuple[Facet, ...]) -> float:
    """Return the fraction of the page on facets narrower than NARROW_MM."""
    outlines = [f.outline for f in facets]
    areas = areas_of(outlines)
    rims = np.array([np.linalg.norm(o - np.roll(o, 1, 0), axis=1).sum() for o in outlines])
    return float(areas[2 * areas / rims < NARROW_MM].sum() / areas.sum())


def _random_plane(rng: np.random.Generator, point: Floats, most_tilt: float) -> Floats:
    """Return a plane (n, d) through a point, tilted at random from level."""
    tilt, azimuth = most_tilt * rng.uniform(0.3, 1), rng.uniform(0, 2 * np.pi)
    upward = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    normal = upward * rng.choice([-1, 1])
    return np.append(normal, normal @ point)


def _mirror(facets: tuple[Facet, ...], plane: Floats) -> tuple[Facet, ...]:
    """The facets, cut at the plane, with the part beyond it mirrored."""
    pieces: list[Facet] = []
    for facet in facets:
        here, beyond = split(facet.outline, facet.place @ plane[:3] - plane[3])
        pieces += [Facet(here, facet.rotation, facet.shift)] if len(here) else []
        pieces += [Facet(beyond, facet.rotation, facet.shift).mirrored(plane)] if len(beyond) else []
    return tuple(pieces)
