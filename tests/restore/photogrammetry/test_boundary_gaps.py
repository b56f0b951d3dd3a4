"""What no view tells of a page's edge is drawn from what is measured beside it."""

from __future__ import annotations

import numpy as np
import pytest

from restore.photogrammetry.boundary_gaps import (
    LONGEST_MM,
    MIN_IN_ROW,
    SPACING_MM,
    STRAY_MM,
    at_corners,
    bridged,
    scattered,
    straightened,
)

HALF = 60.0  # mm, of a square page with a vertex of its edge at every corner
EXACT_MM = 1e-9


def square():
    """(n, 2) mm round a square, counter-clockwise from its lower left corner."""
    side = np.arange(-HALF, HALF, SPACING_MM)
    low, high = np.full(len(side), -HALF), np.full(len(side), HALF)
    sides = [(side, low), (high, side), (-side, high), (low, -side)]
    return np.concatenate([np.column_stack(one) for one in sides])


def unmeasured(places, length_mm):
    """Which of the places are measured, but for a length about the middle of the lower side."""
    return ~((np.abs(places[:, 0]) < length_mm / 2) & (places[:, 1] == -HALF))


@pytest.mark.parametrize(
    ("length_mm", "dent_mm", "drawn"),
    [(40.0, STRAY_MM - 1, True), (40.0, STRAY_MM + 1, False), (LONGEST_MM - 6, 2.0, False)],
)
def test_long_stretches_that_are_nearly_straight_are_drawn_straight(length_mm, dent_mm, drawn):
    true = square()
    measured = unmeasured(true, length_mm)
    given = true + np.where(measured, 0.0, dent_mm)[:, None] * [0.0, 1.0]
    places, straight = straightened(given, measured)
    assert (straight == (~measured if drawn else False)).all()
    np.testing.assert_allclose(places, true if drawn else given, atol=EXACT_MM)


def test_a_tangle_is_drawn_straight():
    true = square()
    measured = unmeasured(true, LONGEST_MM - 6)
    given = true + np.where(measured, 0.0, STRAY_MM * np.arange(len(true)) % 7.0)[:, None] * [1.0, 1.0]
    places, straight = straightened(given, measured)
    assert (straight == ~measured).all()
    np.testing.assert_allclose(places, true, atol=EXACT_MM)


@pytest.mark.parametrize("shift", [0, 37])  # where the first point lies is nothing about an edge
@pytest.mark.parametrize("count", [1, MIN_IN_ROW - 1, MIN_IN_ROW])
def test_points_that_hang_together_with_few_others_are_scattered(count, shift):
    true = np.column_stack([square(), np.zeros(len(square()))])
    measured = unmeasured(true, 40.0)
    stray = np.flatnonzero(~measured)[5 : 5 + count]
    measured[stray] = True
    expected = np.isin(np.arange(len(true)), stray) & (count < MIN_IN_ROW)
    found = scattered(np.roll(true, shift, axis=0), np.roll(measured, shift))
    np.testing.assert_array_equal(found, np.roll(expected, shift))


@pytest.mark.parametrize("shift", [0, 37])
def test_a_step_off_the_edge_parts_it(shift):
    true = np.column_stack([square(), np.zeros(len(square()))])
    off = np.arange(len(true)) // 3 == 5  # three points that hang together two centimetres above the edge
    found = scattered(np.roll(true + off[:, None] * [0.0, 0.0, 20.0], shift, axis=0), np.ones(len(true), bool))
    np.testing.assert_array_equal(found, np.roll(off, shift))
    assert not scattered(true, np.ones(len(true), bool)).any()


def test_short_stretches_are_bridged_in_space_and_long_ones_are_left():
    true = np.column_stack([square(), np.full(len(square()), 3.0)])
    for length_mm, left in ((LONGEST_MM - 6, False), (LONGEST_MM + 10, True)):
        measured = unmeasured(true, length_mm)
        given = true + np.where(measured, 0.0, 1.0)[:, None] * [0.0, 0.0, 1.0]
        np.testing.assert_allclose(bridged(given, measured), given if left else true, atol=EXACT_MM)


def test_corners_are_where_two_sides_meet():
    true = np.column_stack([square(), np.zeros(len(square()))])
    found = at_corners(true)
    corners = (np.abs(true[:, :2]) == HALF).all(axis=1)
    assert found[corners].all()
    assert found.sum() == 3 * corners.sum()  # with the points beside them, which are averaged over both sides
