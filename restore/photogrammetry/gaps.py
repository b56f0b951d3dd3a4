"""Points of a relief where no patch was tracked.

That is next to creases, on narrow facets, on what little a margin shows.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from restore.numerics.robust import NEVER, OUTLYING
from restore.photogrammetry.model import Model
from restore.photogrammetry.page import PageArea, ground_sample
from restore.photogrammetry.surfaces.lattice import Cloud
from restore.photogrammetry.surfaces.page_surface import PageSurface
from restore.photogrammetry.surfaces.surface import grid_places
from restore.photogrammetry.sweep import sweep
from restore.photogrammetry.track import MIN_SIMILAR, Patches, Picture
from restore.scan import Floats, Mask

SPACING_MM = 1.2  # of the places that are tried, and from all tracked points: a third of a patch
EDGE_CLEAR_MM = 3.0  # of the middle of a patch from the edge of the page
SAMPLE = 0.9  # pixels of the photographs to a sample of a patch
REACH_MM = 6.0  # above and below: as far as narrow facets are cut off
STEP_MM = 0.15  # of the heights that are tried: a quarter of a pixel where lines of sight are 60° apart
NOISE_MM = 0.06  # of a height: measured on simulated sheets, three in four are within it
NEIGHBOURS = 5


def fill_gaps(greys: Picture, model: Model, relief: PageSurface, area: PageArea, feet: Floats) -> Cloud:
    """Find points of a relief's page far from tracked ones.

    They are found above or below it.
    feet: (n, 2) mm, of the tracked points.
    greys: (v, h, w), may be smaller copies of what the cameras took.
    """
    low, high = area.bounds
    places = grid_places(low, high, SPACING_MM)
    places = places[area.contains(places, EDGE_CLEAR_MM)]
    places = places[cKDTree(feet).query(places)[0] > SPACING_MM]
    patches = Patches(*relief.frames(places))
    pixel = ground_sample(model.cameras, relief.points((low + high)[None] / 2))
    offsets = np.arange(-REACH_MM, REACH_MM + STEP_MM / 2, STEP_MM)
    heights, sigma, alike = sweep(greys, model.cameras, patches, SAMPLE * pixel, offsets)
    good = (alike > MIN_SIMILAR) & (sigma < OUTLYING * NOISE_MM)
    good[good] = _among_neighbours(places[good], heights[good])
    points = patches.points[good] + heights[good, None] * patches.normals[good]
    return Cloud.of(points, relief.feet(points, places[good]), NOISE_MM)


def _among_neighbours(places: Floats, heights: Floats) -> Mask:
    """Return which heights (n,) mm are like those round them.

    places: (n, 2) mm. Returns (n,) bool.
    """
    if len(places) <= NEIGHBOURS:
        return np.zeros(len(places), bool)
    _, index = cKDTree(places).query(places, NEIGHBOURS + 1)
    return np.asarray(np.abs(heights - np.median(heights[index[:, 1:]], axis=1)) < NEVER * NOISE_MM)
