"""The flat page of a surface over the table: what it is a function of from then on."""

from __future__ import annotations

import numpy as np

from restore.flattening.methods import flatten_points
from restore.mesh.ordered_grid import grid_faces
from restore.photogrammetry.cameras.align import fit_similarity
from restore.photogrammetry.page import PageArea
from restore.photogrammetry.surfaces.surface import Surface, through_places
from restore.scan import Floats, SurfaceMesh

STEP_MM = 8.0  # of the lattice that is flattened: a thousand points, whose flat positions are off by some hundredths


def unrolled(surface: Surface, area: PageArea, margin: float) -> Surface:
    """Return a surface over x and y as one over the flat page.

    It lies as the page does, with a margin, mm.
    """
    low, high = area.bounds
    x, y = (np.arange(start, end + STEP_MM, STEP_MM) for start, end in zip(low - STEP_MM, high, strict=True))
    places = np.stack(np.meshgrid(x, y[::-1]), axis=-1).reshape(-1, 2)
    inside = area.contains(places)
    points = surface.points(places[inside])
    flat = flatten_points(SurfaceMesh(points, grid_faces(inside.reshape(len(y), len(x))))).flat
    flat = _laid(flat, places[inside])
    return through_places(flat, points, flat.min(axis=0) - margin, flat.max(axis=0) + margin)


def _laid(flat: Floats, places: Floats) -> Floats:
    """Flat positions (n, 2) turned and shifted to lie nearest to places (n, 2)."""
    level = np.zeros((len(flat), 1))
    motion = fit_similarity(np.hstack([flat, level]), np.hstack([places, level]))
    return (flat - flat.mean(axis=0)) @ motion.rotation[:2, :2].T + places.mean(axis=0)
