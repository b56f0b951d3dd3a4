"""Two leaves whose gutter gave no range are known as the leaves of one book."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from drivers.simulated import Pose, Spread, Text, shoot
from restore import separate_sheets

SPINE_MM = 130.0
HIDDEN_MM = 12.0  # on either side of the spine: chords across the gutter are somewhat shorter than the paper


@cache
def opened_book(turn_deg=0.0):
    return shoot(Spread(reach_mm=20), Text(), page_mm=(260.0, 180.0), mode="fast", pose=Pose(turn_deg=turn_deg))


def without(scan, hidden):
    return replace(scan, points=np.where(hidden[..., None], np.nan, scan.points))


@pytest.mark.parametrize("turn_deg", [0.0, 4.0])
def test_both_sides_of_a_hidden_gutter_are_named(turn_deg):
    scan, truth = opened_book(turn_deg)
    sheets = separate_sheets(without(scan, np.abs(truth.flat[..., 0] - SPINE_MM) < HIDDEN_MM))
    assert [sheet.part for sheet in sheets] == ["left", "right"]
    assert all(HIDDEN_MM < sheet.gutter_hidden_mm < 2 * HIDDEN_MM for sheet in sheets)


def test_a_narrower_gap_leaves_one_sheet():
    scan, truth = opened_book()
    assert [sheet.part for sheet in separate_sheets(without(scan, np.abs(truth.flat[..., 0] - SPINE_MM) < 2.0))] == [""]


@pytest.mark.parametrize(
    "hidden",
    [
        lambda x, y: np.abs(x - SPINE_MM) < 40.0,  # too far apart
        lambda x, y: (np.abs(x - SPINE_MM) < 12.0) | ((x > SPINE_MM) & (y > 140.0)),  # heads at different places
        lambda x, y: np.abs(x - 40.0) < 12.0,  # a strip
    ],
)
def test_other_sheets_are_not_leaves_of_one_book(hidden):
    scan, truth = opened_book()
    x, y = np.moveaxis(truth.flat, -1, 0)
    assert {sheet.part for sheet in separate_sheets(without(scan, hidden(x, y)))} == {""}
