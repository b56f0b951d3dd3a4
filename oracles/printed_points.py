"""Points as photographs give them of exact sheets: where there is print, and not beside a crease."""

from __future__ import annotations

from functools import cache

import numpy as np

from drivers.simulated.scene.sheets import Sheet
from restore.mesh.ordered_grid import grid_faces
from restore.photogrammetry.surfaces.page_surface import PageSurface
from restore.photogrammetry.surfaces.surface import Surface, fit_surface, grid_places, through_places
from restore.scan import Floats

PAGE_MM = (240.0, 160.0)
HALF = np.array(PAGE_MM) / 2
NOISE_MM = 0.03  # of points tracked in photographs, standard deviation
CLEAR_MM = 2.4  # from a crease: patches that straddle it are not found
CREASE = np.radians(10.0)  # a turn of as much within CLEAR_MM
PRINTED = 0.8  # of the places have print
MARGIN_MM = 12.0  # without print
STEP_MM = 2.0  # of the mesh


def normals(sheet: Sheet, places: Floats) -> Floats:
    """(n, 3) of a sheet at places (n, 2), by differences."""
    step = np.array([[0.05, 0.0], [0.0, 0.05]])
    by = [sheet.warp(places + one, PAGE_MM) - sheet.warp(places - one, PAGE_MM) for one in step]
    normal = np.cross(*by)
    return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))


def sampled(sheet: Sheet, spacing: float = 3.0, noise: float = NOISE_MM, seed: int = 0) -> tuple[Floats, Floats]:
    """Points (n, 3) with noise and their places (n, 2), none beside a crease or in the margin."""
    rng = np.random.default_rng(seed)
    places = grid_places(-HALF + MARGIN_MM, HALF - MARGIN_MM, spacing) + rng.uniform(-0.3, 0.3, 2)
    places = places[rng.random(len(places)) < PRINTED]
    around = CLEAR_MM * np.array([[np.cos(a), np.sin(a)] for a in np.arange(8) * np.pi / 4])
    here = normals(sheet, places)
    turns = [np.arccos(np.clip((normals(sheet, places + way) * here).sum(axis=1), -1, 1)) for way in around]
    places = places[np.max(turns, axis=0) < CREASE]
    return sheet.warp(places, PAGE_MM) + noise * rng.standard_normal((len(places), 3)), places


def rounded(sheet: Sheet, points: Floats) -> tuple[Surface, Floats]:
    """The smooth surface through points (n, 3) of a sheet, and their feet (n, 2)."""
    start = _start(sheet)
    return fit_surface(points, start.nearest(points), start, stiffness=10.0)


@cache
def _start(sheet: Sheet) -> Surface:
    """A surface through a lattice of exact points, larger than the page."""
    low, high = -HALF - 15, HALF + 15
    lattice = grid_places(low, high, 4.0)
    return through_places(lattice, sheet.warp(lattice, PAGE_MM), low, high)


@cache
def _exact(sheet: Sheet) -> Surface:
    """The smooth surface through exact points."""
    return rounded(sheet, sampled(sheet, noise=0.0)[0])[0]


def printed_mesh(surface: PageSurface) -> Floats:
    """(rows, cols, 3) vertices over the print, some of them on the creases."""
    x, y = (np.arange(-half + 15, half - 15, STEP_MM) for half in HALF)
    places = np.stack(np.meshgrid(x, y[::-1]), axis=-1)
    faces = grid_faces(np.ones(places.shape[:2], bool))
    return surface.creased(places.reshape(-1, 2), faces).reshape(*places.shape[:2], 3)


def lost(surface: PageSurface, sheet: Sheet) -> float:
    """Median over the rows of the true length, mm, from end to end less that along the mesh."""
    rows = printed_mesh(surface)
    along = np.linalg.norm(np.diff(rows, axis=1), axis=2).sum(axis=1)
    ends = [true_places(sheet, rows[:, k]) for k in (0, -1)]
    return float(np.median(np.linalg.norm(ends[1] - ends[0], axis=1) - along))


def true_places(sheet: Sheet, points: Floats) -> Floats:
    """(n, 2) places of a flat page whose points in space are next to points (n, 3)."""
    places, step = _exact(sheet).nearest(points), 1e-3
    for _ in range(5):
        here = sheet.warp(places, PAGE_MM)
        by = [(sheet.warp(places + step * axis, PAGE_MM) - here) / step for axis in np.eye(2)]
        places = places + np.stack([((points - here) * one).sum(axis=1) for one in by], axis=1)
    return places
