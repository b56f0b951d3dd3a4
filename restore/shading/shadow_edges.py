"""Lamps placed by the edges of the shadows that the page casts on itself.

A shadow beside paper in full light looks like ink, and is then none of the bare paper that lamps are fitted to. Yet the
edges of shadows tell exactly where a lamp stands, as the light on slopes does not: a degree of a raking lamp moves them
by millimetres. They are near to where a first fit predicts them; there, paper is whatever is as bright as the brightest
within the width of a letter, in light and in shadow alike.
"""

from __future__ import annotations

import cv2
import numpy as np

from restore.scan import Ints, Mask
from restore.shading.channels import as_list, total_of
from restore.shading.lamps import SAMPLES, refit_light
from restore.shading.light import Light, Places
from restore.shading.relief import Field

REACH = 19  # cells, 8 mm: edges lie no farther from where a first fit predicts them
LETTER = 4  # cells, 1.7 mm: so near to every stroke there is paper
PAPER_SHARE = 0.85  # of the brightest within that distance: less is ink, or beside the edge of a shadow
LEAST_CELLS = 100  # fewer place no lamp better


def place_lamps(light: Light, colour: Field, paper: Ints, places: Places, inside: Mask) -> Light:
    """A light fitted anew, its lamps placed where the edges of their shadows are; as it is without any such edges.

    colour (r, c, 3): linear, of cells at places (r · c), those of a mask (r, c) on the page. paper (k,): cells that the
    light was fitted to.
    """
    edges = np.flatnonzero(_near_shadow_edges(light, places, inside) & _locally_bright(colour, inside))
    if len(edges) < LEAST_CELLS:
        return light
    chosen = np.union1d(paper, edges[:: max(1, len(edges) // SAMPLES)])
    return refit_light(light, as_list(colour)[chosen], places[chosen])


def _near_shadow_edges(light: Light, places: Places, inside: Mask) -> Mask:
    """(r, c) True within REACH of the edge of a shadow that a lamp is predicted to cast."""
    around = np.ones((2 * REACH + 1, 2 * REACH + 1), np.uint8)
    near = np.zeros(inside.shape, bool)
    for lamp in range(len(light.lamps)):
        shadow = light.shadows(lamp, places).reshape(inside.shape).view(np.uint8)
        near |= cv2.dilate(shadow, around) != cv2.erode(shadow, around)
    return near


def _locally_bright(colour: Field, inside: Mask) -> Mask:
    """(r, c) True for cells of the page that are as bright as the brightest within a letter's width."""
    total = np.where(inside, total_of(colour), np.float32(0))
    brightest = cv2.dilate(total, np.ones((2 * LETTER + 1, 2 * LETTER + 1), np.uint8))
    return np.asarray(inside & (total > PAPER_SHARE * brightest))
