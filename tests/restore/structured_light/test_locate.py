"""The projector's coordinate at any place of the picture, beside steps too."""

from __future__ import annotations

import numpy as np
import pytest

from restore.structured_light.decode import Axis
from restore.structured_light.locate import locate as locate_lit

EXACT_PX = 1e-5  # crossings are single precision
SHAPE = (40, 60)


def locate(axis, places, radius, reach):
    """As `locate`, with every pixel lit."""
    return locate_lit(axis, np.ones(axis.code.shape, bool), places, radius, reach)


def axis_of(field):
    """The axis (h, w) that a smooth field of projector coordinates makes, without noise."""
    code = np.rint(field).astype(np.int32)
    crossings = []
    for axis in (1, 0):
        here, there = (field[:, :-1], field[:, 1:]) if axis == 1 else (field[:-1], field[1:])
        a, b = (code[:, :-1], code[:, 1:]) if axis == 1 else (code[:-1], code[1:])
        edge = np.minimum(a, b) + 0.5
        crossings.append(np.where(np.abs(a - b) == 1, (edge - here) / (there - here), np.nan).astype(np.float32))
    return Axis(code, *crossings)


def plane(slope_x, slope_y):
    rows, cols = np.indices(SHAPE)
    return 100 + slope_x * cols + slope_y * rows


@pytest.mark.slow
def test_a_plane_is_found_exactly():
    field = plane(0.61, -0.13)
    places = np.random.default_rng(1).uniform([5, 5], [54, 34], (50, 2))
    found = locate(axis_of(field), places, 3.0, 2.0)
    np.testing.assert_allclose(found, 100 + 0.61 * places[:, 0] - 0.13 * places[:, 1], atol=EXACT_PX)


def test_next_to_a_step_both_sides_are_found_as_they_are():
    field = plane(0.6, 0.05)
    field[:, 30:] += 7.3
    axis = axis_of(field)
    axis.across[:, 29] = np.nan
    places = np.column_stack([np.array([26.0, 28.0, 29.0, 30.0, 31.0, 33.0]), np.full(6, 20.0)])
    truth = 100 + 0.6 * places[:, 0] + 0.05 * places[:, 1] + np.where(places[:, 0] > 29.5, 7.3, 0.0)
    np.testing.assert_allclose(locate(axis, places, 3.0, 1.0), truth, atol=EXACT_PX)


def test_without_a_code_nearby_nothing_is_found():
    axis = axis_of(plane(0.6, 0.1))
    axis.code[10:30, 20:40] = -1
    axis.across[10:30, 19:40] = np.nan
    axis.down[9:30, 20:40] = np.nan
    found = locate(axis, np.array([[30.0, 20.0], [10.0, 20.0]]), 3.0, 2.0)
    assert np.isnan(found[0])
    assert np.isfinite(found[1])


def test_a_plane_that_contradicts_the_pixels_own_code_is_not_taken():
    axis = axis_of(plane(0.6, 0.1))
    axis.code[20, 30] += 5
    assert np.isnan(locate(axis, np.array([[30.0, 20.0]]), 3.0, 0.5))[0]


def test_a_single_edge_determines_nothing():
    field = np.where(np.indices(SHAPE)[1] < 30, 100.0, 101.0)
    code = field.astype(np.int32)
    across = np.full((SHAPE[0], SHAPE[1] - 1), np.nan, np.float32)
    across[:, 29] = 0.5
    axis = Axis(code, across, np.full((SHAPE[0] - 1, SHAPE[1]), np.nan, np.float32))
    assert np.isnan(locate(axis, np.array([[30.0, 20.0]]), 3.0, 1.0))[0]


def test_an_unlit_pixel_is_not_looked_at():
    axis, lit = axis_of(plane(0.6, 0.1)), np.ones(SHAPE, bool)
    lit[20, 30] = False
    found = locate_lit(axis, lit, np.array([[30.0, 20.0], [31.0, 20.0]]), 3.0, 2.0)
    assert np.isnan(found[0])
    assert np.isfinite(found[1])
