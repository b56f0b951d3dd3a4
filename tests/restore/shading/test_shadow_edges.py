"""Lamps are placed by the edges of their shadows, which a first fit takes for ink; print there does not mislead."""

from dataclasses import replace

import numpy as np
import pytest

from restore.shading.shadow_edges import place_lamps
from restore.shading.surroundings import surroundings_of
from tests.restore.shading.test_lamps import PAPER, ROOM, bowl, lit_by, surface, toward

CELLS = 201  # a millimetre apart
# Half a degree moves the edge of a shadow of 60 mm, of a lamp 15° above the page, by 2 mm: two cells of this page.
PLACED_DEG = 0.5
FIRST_OFF_DEG = 3.0  # as of the worst page of Miura folds before
LEFT = 1 / 3  # of the cells on the wrong side of an edge: with print a turn along the ridges is not told so well
INK = 0.1


def ridges(x, y):
    return np.maximum(0.0, 16.0 - np.abs(x + 0.1 * y + 30.0)) + np.maximum(0.0, 12.0 - np.abs(x - 50.0))


def shadowed(printed=1.0, azimuth=10.0, polar=75.0):
    """A page with ridges under a raking lamp: its true light, places, colour (r, c, 3) and lit paper."""
    relief = surface(ridges, CELLS)
    true, places = lit_by([toward(azimuth, polar, 8e-4)], [*ROOM, 0.9 * PAPER], relief, surroundings_of(relief))
    colour = true.irradiance(places).reshape(CELLS, CELLS, 3) * np.float32(printed)
    lit = colour.min(axis=2) > 0.6 * colour.max()
    return true, places, colour, np.flatnonzero(lit)[::20]


def turned(light, degrees):
    """A light whose lamps stand higher by so many degrees."""
    return replace(light, lamps=light.lamps - [0.0, np.radians(degrees), 0.0])


def higher(light, other):
    """Degrees by which the lamp of a light stands higher than another: a turn along the ridges moves no edge."""
    return np.degrees(other.lamps[0, 1] - light.lamps[0, 1])


def misplaced(light, true, places):
    """Share of the cells that are in shadow by one light and not by the other."""
    return (light.shadows(0, places) != true.shadows(0, places)).mean()


@pytest.mark.parametrize("degrees", [-FIRST_OFF_DEG, FIRST_OFF_DEG])
def test_a_raking_lamp_is_placed_by_its_shadows(degrees):
    true, places, colour, paper = shadowed()
    inside = np.ones((CELLS, CELLS), bool)
    placed = place_lamps(turned(true, degrees), colour, paper, places, inside)
    assert abs(higher(placed, true)) < PLACED_DEG
    assert misplaced(placed, true, places) < LEFT * misplaced(turned(true, degrees), true, places)


def test_print_next_to_the_edges_does_not_mislead():
    rows, cols = np.indices((CELLS, CELLS))
    strokes = np.where((cols % 5 == 0) & (rows % 8 < 5), INK, 1.0)[..., None]
    true, places, colour, paper = shadowed(strokes)
    first = turned(true, FIRST_OFF_DEG)
    placed = place_lamps(first, colour, paper, places, np.ones((CELLS, CELLS), bool))
    assert misplaced(placed, true, places) < LEFT * misplaced(first, true, places)


def test_a_page_without_shadows_leaves_the_light_as_it_is():
    relief = surface(bowl, CELLS)
    light, places = lit_by([toward(10.0, 30.0, 8e-4)], [*ROOM, 0.9 * PAPER], relief, surroundings_of(relief))
    colour = light.irradiance(places).reshape(CELLS, CELLS, 3)
    assert place_lamps(light, colour, np.arange(100), places, np.ones((CELLS, CELLS), bool)) is light


def test_print_that_is_darker_where_a_lamp_shines_leaves_the_light_as_it_is():
    true, places, colour, paper = shadowed()
    inverse = colour.max() + colour.min() - colour
    assert place_lamps(true, inverse, paper, places, np.ones((CELLS, CELLS), bool)) is true
