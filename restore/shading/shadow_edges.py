"""Places lamps by the edges of the shadows of the page on itself.

A shadow next to paper in full light looks like ink, and is then not part of the bare paper that lamps are fitted to.
Yet the edges of shadows determine exactly where a lamp stands, as the light on slopes does not: a degree of a raking
lamp moves them by millimetres. They are near to where a first fit predicts them; there, the strokes of letters are
closed over by the paper round them, and every cell counts, in light and in shadow alike.
"""

from __future__ import annotations

import cv2
import numpy as np

from restore.scan import Ints, Mask
from restore.shading.channels import as_list
from restore.shading.lamps import SAMPLES, refit_light
from restore.shading.light import Light
from restore.shading.relief import Field
from restore.shading.surroundings import Places

REACH = 19  # cells, 8 mm: edges lie no farther from where a first fit predicts them
STROKE = 5  # cells, 2.1 mm: what is darker and narrower is closed over
MIN_CELLS = 100  # fewer place no lamp better
EDGES = 2 * SAMPLES


def place_lamps(light: Light, colour: Field, paper: Ints, places: Places, inside: Mask) -> Light:
    """Fit a light again, its lamps placed by the edges of shadows.

    It is returned as it is without any such edges.
    colour: (r, c, 3), linear, of cells at places (r · c), those of a mask (r, c) on the page.
    paper: (k,), cells that the light was fitted to.
    """
    edges = np.flatnonzero(inside & _near_shadow_edges(light, places, inside))
    if len(edges) < MIN_CELLS:
        return light
    chosen = np.union1d(paper, edges[:: max(1, len(edges) // EDGES)])
    return refit_light(light, as_list(_closed(colour, inside))[chosen], places[chosen])


def _near_shadow_edges(light: Light, places: Places, inside: Mask) -> Mask:
    """Return the cells within REACH of a predicted shadow's edge, (r, c)."""
    around = np.ones((2 * REACH + 1, 2 * REACH + 1), np.uint8)
    near = np.zeros(inside.shape, bool)
    for lamp in range(len(light.lamps)):
        shadow = light.shadows(lamp, places).reshape(inside.shape).view(np.uint8)
        near |= cv2.dilate(shadow, around) != cv2.erode(shadow, around)
    return near


def _closed(colour: Field, inside: Mask) -> Field:
    """Return the colour of a page without strokes, (r, c, 3).

    A closing, which leaves the edges of shadows where they are.
    """
    window = np.ones((STROKE, STROKE), np.uint8)
    return np.asarray(cv2.morphologyEx(colour * inside[..., None], cv2.MORPH_CLOSE, window))
