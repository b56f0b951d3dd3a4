"""The flat page of a surface over the table."""

from __future__ import annotations

import numpy as np

from restore.photogrammetry.page import CELL_MM, PageArea
from restore.photogrammetry.surfaces.surface import Surface, fit_surface, grid_places
from restore.photogrammetry.unrolled import unrolled

RADIUS_MM, HALF_ANGLE = 80.0, 1.0  # of an arch whose ends stand at 57 degrees
DEPTH_MM = 60.0
FRACTION = 0.8  # of the arc: the lattice that is flattened ends up to 8 mm of the table before the edge
STRAIN = 0.015  # its chords and the spline through them leave; the points decide afterwards


def test_an_arch_becomes_as_long_as_its_arc():
    half = RADIUS_MM * np.sin(HALF_ANGLE)
    places = grid_places(np.array([-half, -DEPTH_MM]), np.array([half, DEPTH_MM]), 2.0)
    points = np.column_stack([places, np.sqrt(RADIUS_MM**2 - places[:, 0] ** 2)])
    level = Surface.level(places.min(axis=0) - 10, places.max(axis=0) + 10, 0.0)
    raised, _ = fit_surface(points, places, level, stiffness=10.0, inextensible=False)
    cells = np.ones((int(2 * DEPTH_MM), int(2 * half)), bool)
    page = unrolled(raised, PageArea(cells, np.array([-half, -DEPTH_MM])), 20.0)
    arc = np.column_stack([np.linspace(-FRACTION, FRACTION, 50) * HALF_ANGLE * RADIUS_MM, np.zeros(50)])
    apart = np.linalg.norm(np.diff(page.points(arc), axis=0), axis=1)
    np.testing.assert_allclose(apart / np.diff(arc[:, 0]), 1.0, atol=STRAIN)  # u is length along the paper
    assert np.ptp(page.points(arc)[:, 0]) > 1.8 * RADIUS_MM * np.sin(FRACTION * HALF_ANGLE)
    assert (np.diff(page.points(arc)[:, 0]) > 0).all()  # and runs as x does
    assert page.bounds[1][0] - page.bounds[0][0] > 2 * HALF_ANGLE * RADIUS_MM + 2 * 20.0 - 10 * CELL_MM
